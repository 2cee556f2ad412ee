// Root mean squares that merge exactly: sums of integers, in any order.
#pragma once

#include <cmath>
#include <cstdint>

namespace btms {

struct Scatter {
  std::int64_t squares_mm2 = 0, count = 0;

  void add(std::int64_t e_mm) {
    squares_mm2 += e_mm * e_mm;
    ++count;
  }
  Scatter& operator+=(const Scatter& o) {
    squares_mm2 += o.squares_mm2;
    count += o.count;
    return *this;
  }
  double mean_square_mm2() const {
    return count > 0 ? static_cast<double>(squares_mm2) / static_cast<double>(count) : 0;
  }
};

// How much the ground's points scatter about the finished surface: its own noise (centimetres on a street, decimetres
// on a forest floor or in an old survey). Points of the ground lie on both sides of the surface, plants and furniture
// only above it; so it is told from the points below.
struct GroundScatter : Scatter {
  void add_below(std::int32_t below_mm) {
    constexpr std::int32_t kDeepest_mm = 1000;  // further down is noise, or another surface
    // No branch: loops over it vectorise.
    const std::int32_t counts = (below_mm > 0 ? 1 : 0) & (below_mm < kDeepest_mm ? 1 : 0), e_mm = below_mm * counts;
    squares_mm2 += std::int32_t{e_mm * e_mm};
    count += counts;
  }
  // Few points hardly move it from what surveys usually have.
  double rms_mm() const {
    constexpr double kUsual_mm = 45, kUsualPoints = 8;
    return std::sqrt((static_cast<double>(squares_mm2) + kUsualPoints * kUsual_mm * kUsual_mm) /
                     (static_cast<double>(count) + kUsualPoints));
  }
};

}  // namespace btms
