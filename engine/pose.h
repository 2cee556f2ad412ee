// Where a sensor was and how it was turned.
#pragma once

#include <array>
#include <cstddef>

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

  // First `b`, then this.
  Pose after(const Pose& b) const {
    Pose out;
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t col = 0; col < 3; ++col) {
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k) sum += rotation[3 * row + k] * b.rotation[3 * k + col];
        out.rotation[3 * row + col] = sum;
      }
    out.place_m = to_map(b.place_m);
    return out;
  }
  Pose inverse() const {
    Pose out;
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t col = 0; col < 3; ++col) out.rotation[3 * row + col] = rotation[3 * col + row];
    const std::array<double, 3> p = out.turned(place_m);
    out.place_m = {-p[0], -p[1], -p[2]};
    return out;
  }
};

}  // namespace btms
