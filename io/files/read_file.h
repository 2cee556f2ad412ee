// A small file as a whole, or a part of one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "engine/error.h"

namespace btms {

// Throws Error(missing_is) when it is absent, no regular file, or larger than `limit_bytes` (checked before
// allocating), Error(kFailed) when the system can't read it. Never blocks on a FIFO.
std::vector<std::uint8_t> read_file(const std::filesystem::path& file, std::uint64_t limit_bytes, ErrorCode missing_is);

// Some of its bytes. Throws as read_file(), Error(missing_is) also when the file has not just `file_bytes`.
// Precondition: offset + n <= file_bytes.
std::vector<std::uint8_t> read_file_part(const std::filesystem::path& file, std::uint64_t file_bytes,
                                         std::uint64_t offset, std::uint64_t n, ErrorCode missing_is);

}  // namespace btms
