// Points in memory as a source.
#pragma once

#include <algorithm>
#include <string>
#include <utility>

#include "engine/tiling/point_source.h"

namespace btms {

// Borrows the block. Thread-safe as long as nobody changes that.
class BlockSource final : public PointSource {
 public:
  explicit BlockSource(const PointBlock& points, std::string name = "memory")
      : points_(points), name_(std::move(name)) {}

  std::string name() const override { return name_; }
  std::uint64_t size() const override { return points_.size(); }
  void read(std::uint64_t first, std::size_t count, PointBlock& block) const override {
    block.reset(count);
    const auto at = static_cast<std::ptrdiff_t>(first);
    std::copy_n(points_.x_mm.begin() + at, count, block.x_mm.begin());
    std::copy_n(points_.y_mm.begin() + at, count, block.y_mm.begin());
    std::copy_n(points_.z_mm.begin() + at, count, block.z_mm.begin());
    // Which of the two reasons a point was dropped for is known of the whole only.
    block.out_of_range = count == points_.size() ? points_.out_of_range : 0;
    block.not_finite =
        static_cast<std::size_t>(std::count(block.x_mm.begin(), block.x_mm.end(), PointBlock::kDroppedX)) -
        block.out_of_range;
  }

 private:
  const PointBlock& points_;
  std::string name_;
};

}  // namespace btms
