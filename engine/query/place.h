// A place on the plane, in metres of the map frame (x east, y north).
#pragma once

namespace btms {

struct Place {
  double x_m = 0, y_m = 0;
  friend bool operator==(const Place&, const Place&) = default;
};

}  // namespace btms
