#include "io/store/commit.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "io/store/hash.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const char* what, const fs::path& file, int error) {
  throw Error(ErrorCode::kFailed, std::string("could not ") + what + ": " + std::strerror(error), file.string());
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  int close() { return ::close(release()); }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

// pread until `bytes` is full; false at an early end of file.
bool read_fully(int fd, std::span<std::uint8_t> bytes, const fs::path& file) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::pread(fd, bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail("read", file, errno);
    if (n == 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return true;
}

}  // namespace

StagedFile::StagedFile(const fs::path& temporary, const fs::path& target, std::span<const std::uint8_t> bytes)
    : temporary_(temporary), target_(target) {
  ::unlink(temporary.c_str());  // left by a run that was killed
  Descriptor file(::open(temporary.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0666));
  if (file.get() < 0) fail("create", temporary, errno);
  try {
    std::size_t done = 0;
    while (done < bytes.size()) {
      const ssize_t n = ::write(file.get(), bytes.data() + done, bytes.size() - done);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) fail("write", temporary, n < 0 ? errno : EIO);
      done += static_cast<std::size_t>(n);
    }
    std::vector<std::uint8_t> back(bytes.size());
    if (!read_fully(file.get(), back, temporary) || xxh3_64(back) != xxh3_64(bytes))
      throw Error(ErrorCode::kFailed, "file reads back differently from what was written", temporary.string());
  } catch (...) {
    ::unlink(temporary.c_str());
    throw;
  }
  ::sync_file_range(file.get(), 0, 0, SYNC_FILE_RANGE_WRITE);  // only a head start, fsync decides
  fd_ = file.release();
}

StagedFile::StagedFile(StagedFile&& o) noexcept
    : temporary_(std::move(o.temporary_)), target_(std::move(o.target_)), fd_(std::exchange(o.fd_, -1)) {}

StagedFile::~StagedFile() {
  if (fd_ < 0) return;
  ::close(fd_);
  ::unlink(temporary_.c_str());
}

void StagedFile::commit() {
  if (::fsync(fd_) != 0) fail("fsync", temporary_, errno);
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail("rename into place", target_, errno);
  if (::close(std::exchange(fd_, -1)) != 0) fail("close", target_, errno);
}

void commit_file(const fs::path& temporary, const fs::path& target, std::span<const std::uint8_t> bytes) {
  StagedFile(temporary, target, bytes).commit();
}

void sync_folder(const fs::path& folder) {
  Descriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd.get() < 0) fail("open", folder, errno);
  if (::fsync(fd.get()) != 0) fail("fsync", folder, errno);
  if (fd.close() != 0) fail("close", folder, errno);
}

std::vector<std::uint8_t> read_file(const fs::path& file, std::uint64_t limit_bytes, ErrorCode missing_is) {
  const Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (fd.get() < 0) {
    const int error = errno;
    if (error == ENOENT || error == ENOTDIR || error == ELOOP || error == ENAMETOOLONG)
      throw Error(missing_is, std::strerror(error), file.string());
    fail("open", file, error);
  }
  struct stat info {};
  if (::fstat(fd.get(), &info) != 0) fail("stat", file, errno);
  if (!S_ISREG(info.st_mode)) throw Error(missing_is, "not a regular file", file.string());
  const auto size = static_cast<std::uint64_t>(info.st_size);
  if (size > limit_bytes)
    throw Error(missing_is,
                "file has " + std::to_string(size) + " bytes, expected at most " + std::to_string(limit_bytes),
                file.string());
  std::vector<std::uint8_t> bytes(size);
  if (!read_fully(fd.get(), bytes, file)) throw Error(missing_is, "changed while read", file.string());
  return bytes;
}

}  // namespace btms
