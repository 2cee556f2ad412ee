#include "io/files/read_file.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>

#include "io/files/descriptor.h"

namespace btms {

namespace {

[[noreturn]] void fail(const std::filesystem::path& file, const char* what, int error) {
  throw Error(ErrorCode::kFailed, std::string("could not ") + what + ": " + system_reason(error), file.string());
}

struct Opened {
  Descriptor fd;
  std::uint64_t bytes = 0;
};

Opened open_regular(const std::filesystem::path& file, ErrorCode missing_is) {
  Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (fd.get() < 0) {
    const int error = errno;
    if (error == ENOENT || error == ENOTDIR || error == ELOOP || error == ENAMETOOLONG)
      throw Error(missing_is, std::strerror(error), file.string());
    fail(file, "open", error);
  }
  struct stat info {};
  if (::fstat(fd.get(), &info) != 0) fail(file, "stat", errno);
  if (!S_ISREG(info.st_mode)) throw Error(missing_is, "not a regular file", file.string());
  return {std::move(fd), static_cast<std::uint64_t>(info.st_size)};
}

std::vector<std::uint8_t> read_range(const std::filesystem::path& file, const Descriptor& fd, std::uint64_t offset,
                                     std::uint64_t n, ErrorCode missing_is) {
  std::vector<std::uint8_t> bytes(n);
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t got = ::pread(fd.get(), bytes.data() + done, bytes.size() - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(file, "read", errno);
    if (got == 0) throw Error(missing_is, "changed while read", file.string());
    done += static_cast<std::size_t>(got);
  }
  return bytes;
}

}  // namespace

std::vector<std::uint8_t> read_file(const std::filesystem::path& file, std::uint64_t limit_bytes,
                                    ErrorCode missing_is) {
  const auto [fd, size] = open_regular(file, missing_is);
  if (size > limit_bytes)
    throw Error(missing_is,
                "file has " + std::to_string(size) + " bytes, expected at most " + std::to_string(limit_bytes),
                file.string());
  return read_range(file, fd, 0, size, missing_is);
}

std::vector<std::uint8_t> read_file_part(const std::filesystem::path& file, std::uint64_t file_bytes,
                                         std::uint64_t offset, std::uint64_t n, ErrorCode missing_is) {
  const auto [fd, size] = open_regular(file, missing_is);
  if (size != file_bytes)
    throw Error(missing_is, "file has " + std::to_string(size) + " bytes, expected " + std::to_string(file_bytes),
                file.string());
  return read_range(file, fd, offset, n, missing_is);
}

}  // namespace btms
