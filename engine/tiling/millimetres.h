// The one place where a coordinate becomes an integer millimetre.
#pragma once

#include <bit>
#include <cmath>
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

// Points that are unpacked at a time: their columns stay in the first-level cache.
inline constexpr std::size_t kMmChunk = 1024;

// A column of raw numbers and how they become millimetres: v * scale + offset, in double.
template <typename Raw>
struct MmColumn {
  const Raw* from;
  double scale, offset;
  double operator[](std::size_t i) const { return static_cast<double>(from[i]) * scale + offset; }
};

// Rounds a column; returns whether every value is inside [-limit, limit], which NaN is not.
template <typename Raw, typename Integer>
bool round_column(MmColumn<Raw> column, std::size_t n, std::int64_t limit, Integer* to) {
  const double most = static_cast<double>(limit);
  std::int64_t inside = 0;  // a sum instead of a branch, so the loop vectorises
  for (std::size_t i = 0; i < n; ++i) {
    const double v = column[i];
    to[i] = static_cast<Integer>(nearest(v));
    inside += std::abs(v) <= most ? 1 : 0;
  }
  return inside == static_cast<std::int64_t>(n);
}

// Replaces what is out of range or not finite among block[at, at + n) and counts it.
template <typename Raw>
void drop_outside(const MmColumn<Raw> (&xyz)[3], std::size_t n, PointBlock& block, std::size_t at) {
  for (std::size_t i = 0; i < n; ++i) {
    const double x = xyz[0][i], y = xyz[1][i], z = xyz[2][i];
    const double horizontal = static_cast<double>(kMaxHorizontal_mm), vertical = static_cast<double>(kMaxVertical_mm);
    if (std::abs(x) <= horizontal && std::abs(y) <= horizontal && std::abs(z) <= vertical) continue;
    const bool finite = std::isfinite(x) && std::isfinite(y) && std::isfinite(z);
    ++(finite ? block.out_of_range : block.not_finite);
    block.x_mm[at + i] = PointBlock::kDroppedX;
    block.y_mm[at + i] = 0;
    block.z_mm[at + i] = 0;
  }
}

// Rounds n points into block[at, at + n).
template <typename Raw>
void round_into(const MmColumn<Raw> (&xyz)[3], std::size_t n, PointBlock& block, std::size_t at) {
  const bool x = round_column(xyz[0], n, kMaxHorizontal_mm, block.x_mm.data() + at);
  const bool y = round_column(xyz[1], n, kMaxHorizontal_mm, block.y_mm.data() + at);
  const bool z = round_column(xyz[2], n, kMaxVertical_mm, block.z_mm.data() + at);
  if (!(x && y && z)) drop_outside(xyz, n, block, at);
}

}  // namespace btms
