// Where a sensor was and how it was turned.
#pragma once

#include <array>

namespace btms {

// Takes places of the sensor's frame to places of the map: rotation * p + place. Metres.
struct Pose {
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};  // row by row, orthonormal
  std::array<double, 3> place_m{};

  std::array<double, 3> turned(const std::array<double, 3>& v) const {
    const auto& r = rotation;
    return {r[0] * v[0] + r[1] * v[1] + r[2] * v[2], r[3] * v[0] + r[4] * v[1] + r[5] * v[2],
            r[6] * v[0] + r[7] * v[1] + r[8] * v[2]};
  }
  std::array<double, 3> to_map(const std::array<double, 3>& p_m) const {
    const std::array<double, 3> v = turned(p_m);
    return {v[0] + place_m[0], v[1] + place_m[1], v[2] + place_m[2]};
  }
};

}  // namespace btms
