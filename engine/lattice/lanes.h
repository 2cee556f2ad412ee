// Four doubles side by side, for loops that work on four nodes at once, a lane each. A lane does what a scalar would,
// so the bits are the same on every CPU. They often hold integers, which add up exactly in any order. Use inside
// BTMS_WIDE functions only.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "engine/lattice/wide.h"

namespace btms {

#define BTMS_INLINE [[gnu::always_inline]] inline

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

BTMS_INLINE bool any_lane(const LongLanes& mask) {
  // In halves: two moves instead of four.
  using Half = std::int64_t __attribute__((vector_size(2 * sizeof(std::int64_t))));
  Half low, high;
  std::memcpy(&low, &mask, sizeof low);
  std::memcpy(&high, reinterpret_cast<const char*>(&mask) + sizeof low, sizeof high);
  low |= high;
  return (low[0] | low[1]) != 0;
}
BTMS_INLINE std::int64_t sum_of_lanes(const LongLanes& v) { return v[0] + v[1] + v[2] + v[3]; }

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

// Added to an integer below 2^51 (in a double), leaves it in the mantissa, without a fraction.
inline constexpr double kIntegerMagic = 6755399441055744.0;  // 1.5 2^52
inline constexpr std::int64_t kBelowMagic = std::int64_t{1} << 51;

// Largest integer <= v.
BTMS_INLINE Lanes floor_lanes(const Lanes& v) {
  double a[kLanes];
  store_lanes(a, v);
  for (double& x : a) x = std::floor(x);
  return load_lanes(a);
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
BTMS_INLINE LongLanes lane_bits(const Lanes& v) {
  LongLanes out;
  std::memcpy(&out, &v, sizeof out);
  return out;
}
// Without a conversion AVX2 hasn't got. Precondition: integers below 2^51.
BTMS_INLINE LongLanes small_integers(const Lanes& v) {
  return lane_bits(v + kIntegerMagic) - lane_bits(Lanes{} + kIntegerMagic);
}
BTMS_INLINE Lanes to_lanes(const Lanes& v) { return v; }
// Any integers; fast below 2^51.
BTMS_INLINE Lanes to_lanes(const LongLanes& v) {
  if (any_lane((v >= kBelowMagic) | (v <= -kBelowMagic))) return __builtin_convertvector(v, Lanes);
  const LongLanes shifted = v + lane_bits(Lanes{} + kIntegerMagic);
  Lanes out;
  std::memcpy(&out, &shifted, sizeof out);
  return out - kIntegerMagic;
}

}  // namespace btms
