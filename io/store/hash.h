// XXH3-64 over bytes, and its text form.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace btms {

// `seed` chains several buffers into one hash: pass the hash of the buffers before.
std::uint64_t xxh3_64(std::span<const std::uint8_t> bytes, std::uint64_t seed = 0);
// 16 lower-case hex digits.
std::string hex64(std::uint64_t value);

}  // namespace btms
