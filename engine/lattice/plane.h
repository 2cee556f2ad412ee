// The plane through a node's three corners, in integers.
#pragma once

#include <array>
#include <cstdint>

#include "engine/lattice/lattice.h"

namespace btms {

inline constexpr std::int32_t kUnknownHeight_mm = INT32_MIN;

// z(x, y) = centre + (rise_x x + rise_y y) / r with x, y from the square's centre, millimetres (paper Eq 13: the cross
// product of the corner differences, normalised, is (-rise_x, -rise_y, r) normalised).
struct FinalPlane {
  std::int64_t centre_mm = 0;
  std::int64_t rise_x_mm = 0;  // height gained over one r along x
  std::int64_t rise_y_mm = 0;

  // corners: centre, then counter-clockwise (triangle_corners()); all known.
  static constexpr FinalPlane through(std::uint8_t triangle, const std::array<std::int32_t, 3>& corners_mm) {
    const std::int64_t m = corners_mm[0], p = corners_mm[1], q = corners_mm[2];
    const std::int64_t out = p + q - 2 * m;  // over r, away from the centre
    const std::int64_t along = q - p;        // over r, counter-clockwise
    switch (triangle) {
      case kEast:
        return {m, out, along};
      case kNorth:
        return {m, -along, out};
      case kWest:
        return {m, -out, -along};
      default:
        return {m, along, -out};
    }
  }
  // tan^2 of the slope, times r^2.
  constexpr std::int64_t rise2_mm2() const { return rise_x_mm * rise_x_mm + rise_y_mm * rise_y_mm; }
};

}  // namespace btms
