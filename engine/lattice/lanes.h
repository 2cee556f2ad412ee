// Four doubles side by side, for loops that work on the four nodes of a square at once, a lane each. A lane does what a
// scalar would, so the bits are the same on every CPU. Use inside BTMS_WIDE functions only.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace btms {

#define BTMS_INLINE [[gnu::always_inline]] inline

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"  // what takes or returns lanes is inlined

inline constexpr std::size_t kLanes = 4;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
using IntLanes = std::int32_t __attribute__((vector_size(kLanes * sizeof(std::int32_t))));
using ShortLanes = std::int16_t __attribute__((vector_size(kLanes * sizeof(std::int16_t))));
using LongLanes = std::int64_t __attribute__((vector_size(kLanes * sizeof(std::int64_t))));

BTMS_INLINE Lanes load_lanes(const double* from) {
  Lanes v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
BTMS_INLINE void store_lanes(double* to, const Lanes& v) { std::memcpy(to, &v, sizeof v); }
BTMS_INLINE bool any_lane(const LongLanes& mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) != 0; }

// Largest integer <= v. Precondition: |v| < 2^51.
BTMS_INLINE Lanes floor_lanes(const Lanes& v) {
  constexpr double kMagic = 6755399441055744.0;  // 1.5 2^52: leaves no fraction
  const Lanes nearest = (v + kMagic) - kMagic;
  return nearest > v ? nearest - 1.0 : nearest;
}
BTMS_INLINE Lanes sqrt_lanes(const Lanes& v) {
  double a[kLanes];
  store_lanes(a, v);
  for (double& x : a) x = std::sqrt(x);
  return load_lanes(a);
}
BTMS_INLINE Lanes max_lanes(const Lanes& a, const Lanes& b) { return a > b ? a : b; }
BTMS_INLINE Lanes abs_lanes(const Lanes& v) { return v < 0.0 ? -v : v; }
BTMS_INLINE Lanes clamp_lanes(const Lanes& v, double limit) {
  const Lanes high = Lanes{} + limit;
  return v < -high ? -high : v > high ? high : v;
}

// Integers are summed in lanes of either kind: both add exactly, LongLanes hold ten more bits and take ten times as
// long.
inline constexpr double kExactInDouble = 9007199254740992.0;  // 2^53

template <class Sum>
BTMS_INLINE Sum lanes_to(const Lanes& v) {
  if constexpr (std::is_same_v<Sum, Lanes>)
    return v;
  else
    return __builtin_convertvector(v, Sum);
}
template <class Sum>
BTMS_INLINE Lanes to_lanes(const Sum& v) {
  if constexpr (std::is_same_v<Sum, Lanes>)
    return v;
  else
    return __builtin_convertvector(v, Lanes);
}

#pragma GCC diagnostic pop

}  // namespace btms
