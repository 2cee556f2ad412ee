// The BGK kernel k(d, l) (paper Eq 7) as an integer in 2^-24, so that sums of kernel values are exact in any order.
//
//   k = (2 + cos 2 pi t)(1 - t)/3 + sin(2 pi t)/(2 pi),  t = d/l < 1
//
// The printed form cancels near t = 1 and turns negative there; k has a fifth-order zero at 1, so k = (1 - t)^5 P(t)
// with a polynomial P of degree 10 (least squares, error 3.1e-10, far below the 2^-25 of the rounding).
#pragma once

#include <cmath>
#include <cstdint>

#include "engine/lattice/lanes.h"

namespace btms {

inline constexpr int kKernelBits = 24;
inline constexpr double kKernelUnit = 1 << kKernelBits;

// The polynomial alone, which is k for 0 <= t < 1; of a double or of lanes.
template <class Value>
[[gnu::always_inline]] inline Value kernel_polynomial(const Value& t) {
  constexpr double kP[] = {0.9999999998379971,   5.000000062559527,   8.420260035579595, 2.1013961828528314,
                           -7.050302527748029,   -4.714134429592761,  2.336901678458754, 2.50501546716526,
                           -0.17377637307124427, -1.1289807251230233, 0.3622101911760698};
  // Estrin's scheme: half as long a chain as Horner's.
  const Value t2 = t * t, t4 = t2 * t2, t8 = t4 * t4;
  const auto pair = [&](int i) { return t * kP[i + 1] + kP[i]; };
  const Value p = (t2 * pair(2) + pair(0)) + t4 * (t2 * pair(6) + pair(4)) + t8 * (t2 * kP[10] + pair(8));
  const Value u = 1.0 - t, u2 = u * u;
  return p * u2 * u2 * u;
}
// Precondition: 0 <= t.  Zero from t = 1 on.
inline double kernel_real(double t) { return t < 1 ? kernel_polynomial(t) : 0; }

inline std::int64_t kernel(double t) { return static_cast<std::int64_t>(kernel_real(t) * kKernelUnit + 0.5); }

}  // namespace btms
