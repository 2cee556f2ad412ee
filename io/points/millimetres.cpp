#include "io/points/millimetres.h"

#include <cmath>

namespace btms {
namespace {

constexpr double kHorizontal = static_cast<double>(kMaxHorizontal_mm);
constexpr double kVertical = static_cast<double>(kMaxVertical_mm);

// False for NaN, too.
bool in_range(double x, double y, double z) {
  return std::abs(x) <= kHorizontal && std::abs(y) <= kHorizontal && std::abs(z) <= kVertical;
}

void drop(const MmChunk& chunk, std::size_t n, PointBlock& block, std::size_t at) {
  for (std::size_t i = 0; i < n; ++i) {
    const double x = chunk.x[i], y = chunk.y[i], z = chunk.z[i];
    if (in_range(x, y, z)) continue;
    const bool finite = std::isfinite(x) && std::isfinite(y) && std::isfinite(z);
    ++(finite ? block.out_of_range : block.not_finite);
    block.x_mm[at + i] = PointBlock::kDroppedX;
    block.y_mm[at + i] = 0;
    block.z_mm[at + i] = 0;
  }
}

// Returns whether all of them are inside [-limit, limit]. The comparison is summed up as integers, without a branch.
template <typename Integer>
bool round_column(const double* from, std::size_t n, double limit, Integer* to) {
  std::int64_t inside = 0;
  for (std::size_t i = 0; i < n; ++i) {
    to[i] = static_cast<Integer>(nearest(from[i]));
    inside += std::abs(from[i]) <= limit ? 1 : 0;
  }
  return inside == static_cast<std::int64_t>(n);
}

}  // namespace

void round_into(const MmChunk& chunk, std::size_t n, PointBlock& block, std::size_t at) {
  const bool x = round_column(chunk.x, n, kHorizontal, block.x_mm.data() + at);
  const bool y = round_column(chunk.y, n, kHorizontal, block.y_mm.data() + at);
  const bool z = round_column(chunk.z, n, kVertical, block.z_mm.data() + at);
  if (!(x && y && z)) drop(chunk, n, block, at);
}

}  // namespace btms
