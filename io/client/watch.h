// A part of the plane that somebody has plans for. Metres.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/query/place.h"

namespace btms {

class Watch {
 public:
  // What is within `reach_m` of a line of places, or of a single one; a little more around its bends.
  static Watch along(std::span<const Place> line, double reach_m);
  static Watch inside(std::span<const Place> polygon);

  // Whether it has a place in the box: min x, min y, max x, max y.
  bool meets(const std::array<double, 4>& box) const;

 private:
  std::vector<Place> places_;
  double reach_m_ = 0;
  bool filled_ = false;
};

}  // namespace btms
