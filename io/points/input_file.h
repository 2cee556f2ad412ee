// A regular file that is read with pread and watched for changes.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "io/files/descriptor.h"

namespace btms {

// Remembers which file it saw (device, inode, size, time of change) and holds no descriptor: a map is built from
// thousands of files, more than a process may have open. Immutable, so thread-safe.
class InputFile {
 public:
  // Never blocks. Throws Error(kBadInput) for anything but a readable regular file, Error(kFailed) when the system is
  // out of handles or memory.
  explicit InputFile(std::filesystem::path path);

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return state_.size; }

  // One use of the file, from one thread: open, read, finish.
  class Session {
   public:
    // Fills `to` from `offset` on. Throws Error(kBadInput) when the file ends before: it was longer when it was opened.
    void read(std::uint64_t offset, std::span<std::uint8_t> to) const;
    // Throws Error(kBadInput) when the file is not as it was when the InputFile was made.
    void finish() const;

   private:
    friend class InputFile;
    Session(const InputFile& file, Descriptor fd) : file_(file), fd_(std::move(fd)) {}
    const InputFile& file_;
    Descriptor fd_;
  };
  // The session must not outlive this object. Throws as the constructor does, and when the file has changed since.
  Session open() const;

  // Throws Error(kBadInput) about this file.
  [[noreturn]] void refuse(const std::string& message, std::optional<std::uint64_t> offset = {}) const;

 private:
  struct State {
    dev_t device = 0;
    ino_t inode = 0;
    std::uint64_t size = 0;
    std::int64_t modified_s = 0, modified_ns = 0;
    friend bool operator==(const State&, const State&) = default;
  };
  Descriptor open_regular() const;
  State state_of(int fd) const;

  std::filesystem::path path_;
  State state_;
};

// Throws "cannot DOING: why" about an input: Error(kBadInput) when it is missing or unreadable, Error(kFailed) for a
// lack of handles or memory, or a failing disk, which are not its fault.
[[noreturn]] void throw_input_error(int error, const char* doing, const std::filesystem::path& path);

}  // namespace btms
