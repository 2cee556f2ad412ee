// LAS integers -> millimetres.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "engine/tiling/point_source.h"

namespace btms {

// Immutable, thread-safe.
class LasScaling {
 public:
  // scale and offset of x, y, z in millimetres.
  LasScaling(const std::array<double, 3>& scale_mm, const std::array<double, 3>& offset_mm);

  // Writes n points to block[at, at + n); n is at most kMmChunk.
  void apply(const std::int32_t* x, const std::int32_t* y, const std::int32_t* z, std::size_t n, PointBlock& block,
             std::size_t at) const;

 private:
  std::array<double, 3> scale_{}, offset_{};
  // Whole millimetres, as nearly all files have: integers from end to end. Same result as the path through double.
  bool whole_ = false;
  std::array<std::int32_t, 3> whole_scale_{};
  std::array<std::int64_t, 3> whole_offset_{};
  std::int32_t lowest_z_ = 0, highest_z_ = 0;  // file integers inside kMaxVertical_mm
};

}  // namespace btms
