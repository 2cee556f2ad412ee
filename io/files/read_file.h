// A small file as a whole.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "engine/error.h"

namespace btms {

// Throws Error(missing_is) when it is absent, no regular file, or larger than `limit_bytes` (checked before
// allocating), Error(kFailed) when the system can't read it. Never blocks on a FIFO.
std::vector<std::uint8_t> read_file(const std::filesystem::path& file, std::uint64_t limit_bytes, ErrorCode missing_is);

}  // namespace btms
