// Exact moments of a node's points: integers, so any order, any lane count and any tiling give the same sums.
//
// x, y from the square's centre (|x|, |y| <= 2^15 mm), z from a datum of the node, clamped to +-2^18 mm: every sum
// stays below 2^63 for up to kMaxNodePoints points; more in one node are refused before they are summed.
#pragma once

#include <cstdint>

#include "engine/terrain/symmetric_eigen.h"

namespace btms {

inline constexpr std::int32_t kMaxNodeRelief_mm = 1 << 18;
inline constexpr std::uint32_t kMaxNodePoints = (1u << 27) - 1;

struct Moments {
  std::int64_t n = 0, x = 0, y = 0, z = 0, xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  friend bool operator==(const Moments&, const Moments&) = default;
};

// n Sab - Sa Sb, exact, then one rounding to double.
inline double central(const Moments& m, std::int64_t ab, std::int64_t a, std::int64_t b) {
  if (m.n < (1 << 13)) return static_cast<double>(m.n * ab - a * b);  // fits: n Sab < 2^13 2^13 2^36
  return static_cast<double>(static_cast<__int128>(m.n) * ab - static_cast<__int128>(a) * b);
}

// Covariance with 1/n, in mm^2. Precondition: n > 0.
inline SymmetricMatrix covariance(const Moments& m) {
  const double n = static_cast<double>(m.n), scale = 1 / (n * n);
  return {central(m, m.xx, m.x, m.x) * scale, central(m, m.xy, m.x, m.y) * scale, central(m, m.xz, m.x, m.z) * scale,
          central(m, m.yy, m.y, m.y) * scale, central(m, m.yz, m.y, m.z) * scale, central(m, m.zz, m.z, m.z) * scale};
}

}  // namespace btms
