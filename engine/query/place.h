// A place on the plane, in metres of the map frame (x east, y north).
#pragma once

#include <cmath>
#include <cstdint>

#include "engine/lattice/coordinates.h"

namespace btms {

struct Place {
  double x_m = 0, y_m = 0;
  friend bool operator==(const Place&, const Place&) = default;
};

struct PlaceMm {
  std::int64_t x, y;
  friend bool operator==(const PlaceMm&, const PlaceMm&) = default;
};

// Whether a map can be there: not at NaN, at infinity, or further out than maps go.
inline bool on_plane(Place p) {
  constexpr double kLimit_m = static_cast<double>(kMaxHorizontal_mm) / 1000;
  return std::abs(p.x_m) <= kLimit_m && std::abs(p.y_m) <= kLimit_m;
}

inline std::int64_t to_mm(double m) { return static_cast<std::int64_t>(std::floor(m * 1000 + 0.5)); }
// As points are rounded. Precondition: on_plane(p).
inline PlaceMm to_mm(Place p) { return {to_mm(p.x_m), to_mm(p.y_m)}; }

}  // namespace btms
