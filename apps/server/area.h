// A part of the plane that a client asks about: a disc or a simple polygon, and the boxes it meets. Metres.
#pragma once

#include <array>
#include <vector>

#include "engine/lattice/tiles.h"
#include "engine/query/place.h"

namespace btms {

class Area {
 public:
  static Area disc(Place centre, double radius_m);
  static Area polygon(std::vector<Place> corners);  // at least three, in order

  using Box = std::array<double, 4>;  // min x, min y, max x, max y
  bool meets(const Box& box) const;
  // From the centre to the box's centre.
  double distance2_m2(const Box& box) const;
  // Squares of an edge that may meet it.
  CellBox tiles(double edge_m) const;

 private:
  Place centre_;
  double radius_m_ = 0;
  std::vector<Place> corners_;  // empty: a disc
  Box bounds_{};
};

}  // namespace btms
