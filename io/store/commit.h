// Files that appear whole or not at all: temporary name, every return code checked, fsync, rename, fsync of the folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "engine/error.h"

namespace btms {

// Prefix of temporary names; whatever starts with it is nobody's and may be deleted.
inline constexpr char kTemporaryPrefix[] = ".tmp-";

// A file written under its temporary name and read back, but not durable yet. Staging several files before committing
// them costs one flush of the disk instead of one a file.
class StagedFile {
 public:
  // Throws Error(kFailed), like commit().
  StagedFile(const std::filesystem::path& temporary, const std::filesystem::path& target,
             std::span<const std::uint8_t> bytes);
  StagedFile(StagedFile&& o) noexcept;
  StagedFile& operator=(StagedFile&&) = delete;
  ~StagedFile();  // removes the temporary file, unless committed

  // fsync, close, rename. The new name is durable after sync_folder() of its folder.
  void commit();

 private:
  std::filesystem::path temporary_, target_;
  int fd_ = -1;
};

// Stages and commits one file.
void commit_file(const std::filesystem::path& temporary, const std::filesystem::path& target,
                 std::span<const std::uint8_t> bytes);

// Throws Error(kFailed).
void sync_folder(const std::filesystem::path& folder);

// The whole file. Throws Error(missing_is) when it is absent, no regular file, or larger than `limit_bytes` (checked
// before allocating), Error(kFailed) when the system can't read it. Never blocks on a FIFO.
std::vector<std::uint8_t> read_file(const std::filesystem::path& file, std::uint64_t limit_bytes, ErrorCode missing_is);

}  // namespace btms
