#include "io/points/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>
#include <utility>

#include "engine/error.h"

namespace btms {
void throw_input_error(int error, const char* doing, const std::filesystem::path& path) {
  const bool input = error == ENOENT || error == EACCES || error == EPERM || error == ELOOP || error == ENOTDIR ||
                     error == ENXIO || error == ENAMETOOLONG || error == ENODEV || error == EISDIR;
  throw Error(input ? ErrorCode::kBadInput : ErrorCode::kFailed,
              std::string("cannot ") + doing + ": " + system_reason(error), path.string());
}

InputFile::InputFile(std::filesystem::path path) : path_(std::move(path)), state_(state_of(open_regular().get())) {}

void InputFile::refuse(const std::string& message, std::optional<std::uint64_t> offset) const {
  throw Error(ErrorCode::kBadInput, message, path_.string(), offset);
}

Descriptor InputFile::open_regular() const {
  // Without O_NONBLOCK the open of a FIFO would wait for a writer.
  Descriptor fd(::open(path_.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY));
  if (fd.get() < 0) throw_input_error(errno, "open", path_);
  return fd;
}

InputFile::State InputFile::state_of(int fd) const {
  struct stat s {};
  if (::fstat(fd, &s) != 0) throw_input_error(errno, "stat", path_);
  if (!S_ISREG(s.st_mode)) refuse("not a regular file; expected a point file on disk");
  return {s.st_dev, s.st_ino, static_cast<std::uint64_t>(s.st_size), s.st_mtim.tv_sec, s.st_mtim.tv_nsec};
}

InputFile::Session InputFile::open() const {
  Session session(*this, open_regular());
  session.finish();
  return session;
}

void InputFile::Session::finish() const {
  const State now = file_.state_of(fd_.get());
  if (now == file_.state_) return;
  file_.refuse("changed while read: it had " + std::to_string(file_.state_.size) + " bytes, now " +
               std::to_string(now.size) + "; run again when nothing writes to it");
}

void InputFile::Session::read(std::uint64_t offset, std::span<std::uint8_t> to) const {
  while (!to.empty()) {
    const ssize_t got = ::pread(fd_.get(), to.data(), to.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw_input_error(errno, "read", file_.path_);
    if (got == 0) {
      file_.refuse("changed while read: it ends here, expected " + std::to_string(to.size()) + " more bytes of " +
                       std::to_string(file_.state_.size),
                   offset);
    }
    offset += static_cast<std::uint64_t>(got);
    to = to.subspan(static_cast<std::size_t>(got));
  }
}

}  // namespace btms
