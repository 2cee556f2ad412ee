// A point file read into memory, so that a scan's time can be measured without file access.
#pragma once

#include <algorithm>

#include "engine/tiling/point_source.h"

namespace btms {

// Immutable, thread-safe.
class MemorySource final : public PointSource {
 public:
  // Throws what `file` throws.
  explicit MemorySource(const PointSource& file) : name_(file.name()) {
    file.read(0, static_cast<std::size_t>(file.size()), points_);
  }

  std::string name() const override { return name_; }
  std::uint64_t size() const override { return points_.size(); }
  void read(std::uint64_t first, std::size_t count, PointBlock& block) const override {
    block.reset(count);
    const auto at = static_cast<std::ptrdiff_t>(first);
    std::copy_n(points_.x_mm.begin() + at, count, block.x_mm.begin());
    std::copy_n(points_.y_mm.begin() + at, count, block.y_mm.begin());
    std::copy_n(points_.z_mm.begin() + at, count, block.z_mm.begin());
    // Which of the two reasons a point was dropped for is known of the whole only.
    if (count == points_.size()) {
      block.not_finite = points_.not_finite;
      block.out_of_range = points_.out_of_range;
    } else {
      block.not_finite =
          static_cast<std::size_t>(std::count(block.x_mm.begin(), block.x_mm.end(), PointBlock::kDroppedX));
    }
  }

 private:
  std::string name_;
  PointBlock points_;
};

}  // namespace btms
