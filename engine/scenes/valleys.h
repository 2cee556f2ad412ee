// Parallel valleys with straight sides.
#pragma once

#include <cmath>

namespace btms {

// How far up the side of a valley a place is, in metres along the ground: about 0 in the valley, half a period on the
// ridge. `rounded` is the share of a side that each of its ends takes to become level (continuous slope).
inline double valley_side(double across_m, double period_m, double rounded) {
  const double p = across_m / period_m, r = rounded;
  const double t = 2 * std::abs(p - std::floor(p + 0.5));
  const double side = t < r ? t * t / (2 * r) + r / 2 : t > 1 - r ? 1 - r / 2 - (1 - t) * (1 - t) / (2 * r) : t;
  return side * period_m / 2;
}

}  // namespace btms
