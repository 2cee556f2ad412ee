#include "engine/scenes/object_grid.h"

#include <algorithm>

namespace btms {

ObjectGrid::ObjectGrid(const Box& box, std::span<const Object> objects, double margin_m)
    : box_(box),
      columns_(static_cast<std::size_t>(std::max(box.x1_m - box.x0_m, box.y1_m - box.y0_m) / kCell_m) + 1),
      starts_(columns_ * columns_ + 1) {
  const auto visit = [&](const auto& f) {
    for (std::uint32_t i = 0; i < objects.size(); ++i) {
      const Box b = objects[i].bounds(margin_m);
      if (!b.meets(box_)) continue;
      for (std::size_t row = index(b.y0_m, box_.y0_m); row <= index(b.y1_m, box_.y0_m); ++row)
        for (std::size_t col = index(b.x0_m, box_.x0_m); col <= index(b.x1_m, box_.x0_m); ++col)
          f(col + columns_ * row, i);
    }
  };
  visit([&](std::size_t cell, std::uint32_t) { ++starts_[cell + 1]; });
  for (std::size_t c = 1; c < starts_.size(); ++c) starts_[c] += starts_[c - 1];
  items_.resize(starts_.back());
  std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
  visit([&](std::size_t cell, std::uint32_t i) { items_[next[cell]++] = i; });
}

}  // namespace btms
