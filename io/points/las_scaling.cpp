#include "io/points/las_scaling.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/tiling/millimetres.h"

namespace btms {
namespace {

using Limits = std::numeric_limits<std::int32_t>;

// No file integer leaves the range, so nothing has to be checked point by point.
bool always_in_range(std::int32_t scale, std::int64_t offset) {
  const std::int64_t reach = -static_cast<std::int64_t>(Limits::min()) * scale;
  return std::abs(offset) + reach <= kMaxHorizontal_mm;
}

void scale_column(const std::int32_t* from, std::size_t n, std::int32_t scale, std::int64_t offset, std::int64_t* to) {
  if (scale == 1) {  // SSE has no 64-bit multiplication
    for (std::size_t i = 0; i < n; ++i) to[i] = from[i] + offset;
  } else {
    for (std::size_t i = 0; i < n; ++i) to[i] = static_cast<std::int64_t>(from[i]) * scale + offset;
  }
}

}  // namespace

LasScaling::LasScaling(const std::array<double, 3>& scale_mm, const std::array<double, 3>& offset_mm)
    : scale_(scale_mm), offset_(offset_mm) {
  constexpr double kMostScale = 1 << 20, kMostOffset = 1e12;  // nothing below overflows
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double scale = scale_[axis], offset = offset_[axis];
    if (!(scale == std::floor(scale) && scale <= kMostScale)) return;
    if (!(offset == std::floor(offset) && std::abs(offset) <= kMostOffset)) return;
    whole_scale_[axis] = static_cast<std::int32_t>(scale);
    whole_offset_[axis] = static_cast<std::int64_t>(offset);
  }
  const std::int64_t low = ceil_div(-kMaxVertical_mm - whole_offset_[2], whole_scale_[2]);
  const std::int64_t high = floor_div(kMaxVertical_mm - whole_offset_[2], whole_scale_[2]);
  if (low > Limits::max() || high < Limits::min()) return;
  lowest_z_ = static_cast<std::int32_t>(std::max<std::int64_t>(low, Limits::min()));
  highest_z_ = static_cast<std::int32_t>(std::min<std::int64_t>(high, Limits::max()));
  whole_ = always_in_range(whole_scale_[0], whole_offset_[0]) && always_in_range(whole_scale_[1], whole_offset_[1]);
}

void LasScaling::apply(const std::int32_t* x, const std::int32_t* y, const std::int32_t* z, std::size_t n,
                       PointBlock& block, std::size_t at) const {
  const MmColumn<std::int32_t> columns[3] = {
      {x, scale_[0], offset_[0]}, {y, scale_[1], offset_[1]}, {z, scale_[2], offset_[2]}};
  if (!whole_) return round_into(columns, n, block, at);
  scale_column(x, n, whole_scale_[0], whole_offset_[0], block.x_mm.data() + at);
  scale_column(y, n, whole_scale_[1], whole_offset_[1], block.y_mm.data() + at);
  // Heights modulo 2^32: right for those that fit, and the others are dropped.
  const auto scale = static_cast<std::uint32_t>(whole_scale_[2]), offset = static_cast<std::uint32_t>(whole_offset_[2]);
  std::int32_t* const to = block.z_mm.data() + at;
  std::int32_t inside = 0;
  for (std::size_t i = 0; i < n; ++i) {
    to[i] = static_cast<std::int32_t>(static_cast<std::uint32_t>(z[i]) * scale + offset);
    inside += static_cast<std::int32_t>(z[i] >= lowest_z_) & static_cast<std::int32_t>(z[i] <= highest_z_);
  }
  if (inside != static_cast<std::int32_t>(n)) drop_outside(columns, n, block, at);
}

}  // namespace btms
