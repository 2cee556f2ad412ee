// Exact moments of the points of four nodes at once, a lane each: integers, so any order, any lane count and any tiling
// give the same sums.
//
// x, y from the square's centre (|x|, |y| <= 2^15 mm), z from a datum of the node, clamped to +-2^18 mm: every sum
// stays below 2^63 for up to kMaxNodePoints points (more in one node are refused before they are summed), and below
// 2^53, where doubles are exact, for up to kExactNodePoints.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "engine/lattice/lanes.h"
#include "engine/terrain/moments.h"
#include "engine/terrain/symmetric_eigen.h"

namespace btms {

inline constexpr std::size_t kExactNodePoints = 1 << 16;

// `Sum` is Lanes or, for crowded nodes, LongLanes.
template <class Sum>
struct Moments {
  Sum n{}, x{}, y{}, z{}, xx{}, xy{}, xz{}, yy{}, yz{}, zz{};

  BTMS_INLINE void add(const Lanes& one, const Lanes& px, const Lanes& py, const Lanes& pz, const LongLanes& keep) {
    const Sum kx = lanes_to<Sum>(keep ? px : Lanes{}), ky = lanes_to<Sum>(keep ? py : Lanes{});
    const Sum kz = lanes_to<Sum>(keep ? pz : Lanes{});
    n += lanes_to<Sum>(keep ? one : Lanes{});
    x += kx;
    y += ky;
    z += kz;
    xx += kx * kx;
    xy += kx * ky;
    xz += kx * kz;
    yy += ky * ky;
    yz += ky * kz;
    zz += kz * kz;
  }
};

template <class Sum>
BTMS_INLINE LongLanes equal(const Moments<Sum>& a, const Moments<Sum>& b) {
  return (a.n == b.n) & (a.x == b.x) & (a.y == b.y) & (a.z == b.z) & (a.xx == b.xx) & (a.xy == b.xy) & (a.xz == b.xz) &
         (a.yy == b.yy) & (a.yz == b.yz) & (a.zz == b.zz);
}

// n Sab - Sa Sb, exact, then one rounding to double.
template <class Sum>
BTMS_INLINE Lanes central(const Sum& n, const Sum& ab, const Sum& a, const Sum& b) {
  const Lanes whole = to_lanes(n) * to_lanes(ab), means = to_lanes(a) * to_lanes(b);
  if (!any_lane((abs_lanes(whole) >= kExactInDouble) | (abs_lanes(means) >= kExactInDouble))) return whole - means;
  Lanes out{};
  for (std::size_t k = 0; k < kLanes; ++k)
    out[k] =
        static_cast<double>(static_cast<__int128>(static_cast<std::int64_t>(n[k])) * static_cast<std::int64_t>(ab[k]) -
                            static_cast<__int128>(static_cast<std::int64_t>(a[k])) * static_cast<std::int64_t>(b[k]));
  return out;
}

// Covariances with 1/n, in mm^2; not finite where n = 0.
template <class Sum>
BTMS_INLINE SymmetricMatrices covariance(const Moments<Sum>& m) {
  const Lanes n = to_lanes(m.n), scale = 1.0 / (n * n);
  return {central(m.n, m.xx, m.x, m.x) * scale, central(m.n, m.xy, m.x, m.y) * scale,
          central(m.n, m.xz, m.x, m.z) * scale, central(m.n, m.yy, m.y, m.y) * scale,
          central(m.n, m.yz, m.y, m.z) * scale, central(m.n, m.zz, m.z, m.z) * scale};
}

}  // namespace btms
