#include "io/points/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "engine/error.h"

namespace btms {

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
  // A short name of its own: the final name with a suffix could exceed what the file system allows.
  for (int attempt = 0; fd_ < 0; ++attempt) {
    temporary_ = folder() / (".btms-" + std::to_string(::getpid()) + "-" + std::to_string(attempt) + ".tmp");
    fd_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd_ < 0 && (errno != EEXIST || attempt == 100'000)) fail(errno, "create a file for");
  }
}

OutputFile::~OutputFile() {
  if (fd_ >= 0) ::close(fd_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void OutputFile::fail(int error, const char* doing) const {
  throw Error(ErrorCode::kFailed, std::string("cannot ") + doing + " it: " + std::generic_category().message(error),
              path_.string());
}

std::filesystem::path OutputFile::folder() const { return path_.has_parent_path() ? path_.parent_path() : "."; }

void OutputFile::reserve(std::uint64_t bytes) {
  if (bytes == 0) return;
  const int error = ::posix_fallocate(fd_, 0, static_cast<off_t>(bytes));
  // Not every file system can reserve; the write will tell then.
  if (error != 0 && error != EOPNOTSUPP && error != EINVAL) fail(error, "reserve space for");
}

void OutputFile::write(std::uint64_t offset, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t put = ::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) fail(put < 0 ? errno : EIO, "write");
    offset += static_cast<std::uint64_t>(put);
    bytes = bytes.subspan(static_cast<std::size_t>(put));
  }
}

void OutputFile::commit() {
  if (::fsync(fd_) != 0) fail(errno, "sync");
  if (::close(std::exchange(fd_, -1)) != 0) fail(errno, "close");
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) fail(errno, "rename");
  temporary_.clear();
  // The rename itself is durable only once the folder is.
  const int folder_fd = ::open(folder().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder_fd < 0) fail(errno, "sync the folder of");
  const int synced = ::fsync(folder_fd);
  const int error = errno;
  ::close(folder_fd);
  if (synced != 0 && error != EINVAL) fail(error, "sync the folder of");
}

}  // namespace btms
