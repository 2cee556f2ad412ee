// A file that appears under its name only when it is complete: temporary name, fsync, rename.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace btms {

// write() is thread-safe for disjoint ranges. Every failure is an Error(kFailed) that names the final path. Without
// commit() the temporary file is removed and a file of that name, if there was one, is untouched.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  const std::filesystem::path& path() const { return path_; }
  // Takes the disk space now, so that a full disk shows before the work and not after it.
  void reserve(std::uint64_t bytes);
  void write(std::uint64_t offset, std::span<const std::uint8_t> bytes);
  void commit();

 private:
  [[noreturn]] void fail(int error, const char* doing) const;
  std::filesystem::path folder() const;

  std::filesystem::path path_, temporary_;
  int fd_ = -1;
};

}  // namespace btms
