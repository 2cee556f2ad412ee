// How much the ground's points scatter about the finished surface: its own noise (centimetres on a street, decimetres
// on a forest floor or in an old survey). Points of the ground lie on both sides of the surface, plants and furniture
// only above it; so the scatter is told from the points below.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace btms {

struct GroundSpread {
  std::int64_t squares_mm2 = 0, points = 0;

  // A point `below_mm` under the surface.
  void add(std::int64_t below_mm) {
    constexpr std::int64_t kDeepest_mm = 1000;  // further down is noise, or another surface
    if (below_mm <= 0 || below_mm >= kDeepest_mm) return;
    squares_mm2 += below_mm * below_mm;
    ++points;
  }
  GroundSpread& operator+=(const GroundSpread& o) {
    squares_mm2 += o.squares_mm2;
    points += o.points;
    return *this;
  }
  // Standard deviation; never below what a good survey has, and few points hardly move it from there.
  double sd_mm() const {
    constexpr double kUsual_mm = 40, kUsualPoints = 8;
    const double mean = (static_cast<double>(squares_mm2) + kUsualPoints * kUsual_mm * kUsual_mm) /
                        (static_cast<double>(points) + kUsualPoints);
    return std::max(kUsual_mm, std::sqrt(mean));
  }
};

}  // namespace btms
