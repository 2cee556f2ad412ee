#include "io/files/read_file.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>

#include "io/files/descriptor.h"

namespace btms {

std::vector<std::uint8_t> read_file(const std::filesystem::path& file, std::uint64_t limit_bytes,
                                    ErrorCode missing_is) {
  const auto fail = [&](const char* what, int error) {
    throw Error(ErrorCode::kFailed, std::string("could not ") + what + ": " + system_reason(error), file.string());
  };
  const Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (fd.get() < 0) {
    const int error = errno;
    if (error == ENOENT || error == ENOTDIR || error == ELOOP || error == ENAMETOOLONG)
      throw Error(missing_is, std::strerror(error), file.string());
    fail("open", error);
  }
  struct stat info {};
  if (::fstat(fd.get(), &info) != 0) fail("stat", errno);
  if (!S_ISREG(info.st_mode)) throw Error(missing_is, "not a regular file", file.string());
  const auto size = static_cast<std::uint64_t>(info.st_size);
  if (size > limit_bytes)
    throw Error(missing_is,
                "file has " + std::to_string(size) + " bytes, expected at most " + std::to_string(limit_bytes),
                file.string());
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t got = ::pread(fd.get(), bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail("read", errno);
    if (got == 0) throw Error(missing_is, "changed while read", file.string());
    done += static_cast<std::size_t>(got);
  }
  return bytes;
}

}  // namespace btms
