// The objects of one block, sorted into cells, so that a pulse meets only the few around it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/scenes/object.h"

namespace btms {

class ObjectGrid {
 public:
  // `objects` must outlive the grid. Objects count `margin_m` beyond their footprint.
  ObjectGrid(const Box& box, std::span<const Object> objects, double margin_m);

  // Indices of the objects near a place of the box.
  std::span<const std::uint32_t> near(double x_m, double y_m) const {
    const std::size_t cell = index(x_m, box_.x0_m) + columns_ * index(y_m, box_.y0_m);
    return std::span(items_).subspan(starts_[cell], starts_[cell + 1] - starts_[cell]);
  }

 private:
  static constexpr double kCell_m = 2;
  std::size_t index(double a, double a0) const {
    return a <= a0 ? 0 : std::min(columns_ - 1, static_cast<std::size_t>((a - a0) / kCell_m));
  }

  Box box_;
  std::size_t columns_;
  std::vector<std::uint32_t> starts_, items_;
};

}  // namespace btms
