// Sine and cosine on [0, pi/2] from +, * and / alone. glibc picks its variants by CPU and their last bits differ, so no
// pass may call it; these give the same bits everywhere. Taylor series around the nearer end: error below 1e-15.
#pragma once

#include <algorithm>

namespace btms {

inline constexpr double kPi = 3.14159265358979323846;

namespace detail {
constexpr double sine_series(double x) {  // |x| <= pi/4
  const double x2 = x * x;
  double term = x, sum = x;
  for (int n = 1; n <= 9; ++n) sum += (term *= -x2 / ((2 * n) * (2 * n + 1)));
  return sum;
}
constexpr double cosine_series(double x) {  // |x| <= pi/4
  const double x2 = x * x;
  double term = 1, sum = 1;
  for (int n = 1; n <= 9; ++n) sum += (term *= -x2 / ((2 * n - 1) * (2 * n)));
  return sum;
}
}  // namespace detail

// Precondition: 0 <= x <= pi/2.
constexpr double sine(double x) { return x <= kPi / 4 ? detail::sine_series(x) : detail::cosine_series(kPi / 2 - x); }
constexpr double cosine(double x) { return x <= kPi / 4 ? detail::cosine_series(x) : detail::sine_series(kPi / 2 - x); }
constexpr double radians(double deg) { return deg * (kPi / 180.0); }

}  // namespace btms
