// The one place where a coordinate becomes an integer millimetre.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "engine/tiling/point_source.h"

namespace btms {

// Nearest integer, ties to even, for |v| < 2^51. In this range the sum with 1.5 * 2^52 has the integer in its low bits:
// one addition, the same bits on every instruction set, and it vectorises where a call of lrint would not.
inline std::int64_t nearest(double v) {
  constexpr double kShift = 0x1.8p52;
  // Unsigned, since what is out of range (and dropped later) may wrap.
  return static_cast<std::int64_t>(std::bit_cast<std::uint64_t>(v + kShift) - std::bit_cast<std::uint64_t>(kShift));
}

// Coordinates in millimetres, not rounded yet. Small enough to stay in the first-level cache.
struct MmChunk {
  static constexpr std::size_t kPoints = 512;
  double x[kPoints], y[kPoints], z[kPoints];
};

// Rounds the first n points of `chunk` into block[at, at + n). Points that are not finite or out of range are dropped
// and counted.
void round_into(const MmChunk& chunk, std::size_t n, PointBlock& block, std::size_t at);

}  // namespace btms
