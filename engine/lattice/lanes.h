// Four doubles side by side, for loops marked BTMS_WIDE. They often hold integers, which add up exactly in any order.
#pragma once

#include <cstdint>
#include <cstring>

#include "engine/lattice/wide.h"

#pragma GCC diagnostic ignored "-Wpsabi"  // what takes or returns lanes is inlined

namespace btms {

#define BTMS_INLINE [[gnu::always_inline]] inline

inline constexpr std::size_t kLanes = 4;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
using LongLanes = std::int64_t __attribute__((vector_size(kLanes * sizeof(std::int64_t))));
using IntLanes = std::int32_t __attribute__((vector_size(kLanes * sizeof(std::int32_t))));

// Added to an integer below 2^51 (in a double), leaves it in the mantissa.
inline constexpr double kMagic = 6755399441055744.0;  // 1.5 2^52
inline constexpr std::int64_t kExactlyStored = std::int64_t{1} << 51;

BTMS_INLINE LongLanes bits(const Lanes& v) {
  LongLanes out;
  std::memcpy(&out, &v, sizeof out);
  return out;
}
BTMS_INLINE bool any(const LongLanes& mask) {
  // In halves: two moves instead of four.
  using Half = std::int64_t __attribute__((vector_size(2 * sizeof(std::int64_t))));
  Half low, high;
  std::memcpy(&low, &mask, sizeof low);
  std::memcpy(&high, reinterpret_cast<const char*>(&mask) + sizeof low, sizeof high);
  low |= high;
  return (low[0] | low[1]) != 0;
}
BTMS_INLINE std::int64_t total(const LongLanes& v) { return v[0] + v[1] + v[2] + v[3]; }
// Precondition: integers below 2^51.
BTMS_INLINE LongLanes to_integers(const Lanes& v) { return bits(v + kMagic) - bits(Lanes{} + kMagic); }
BTMS_INLINE Lanes to_doubles(const LongLanes& v) {
  if (any((v >= kExactlyStored) | (v <= -kExactlyStored))) return __builtin_convertvector(v, Lanes);
  const LongLanes shifted = v + bits(Lanes{} + kMagic);
  Lanes out;
  std::memcpy(&out, &shifted, sizeof out);
  return out - kMagic;
}
BTMS_INLINE Lanes to_doubles(const IntLanes& v) { return __builtin_convertvector(v, Lanes); }
// Precondition: below 2^51.
BTMS_INLINE Lanes floor_of(const Lanes& v) {
  const Lanes nearest = (v + kMagic) - kMagic;
  return nearest > v ? nearest - 1.0 : nearest;
}
BTMS_INLINE Lanes limited(const Lanes& v, double limit) {
  const Lanes high = Lanes{} + limit;
  return v < -high ? -high : v > high ? high : v;
}
BTMS_INLINE Lanes root_of(const Lanes& v) {
  Lanes out;
  for (std::size_t k = 0; k < kLanes; ++k) out[k] = __builtin_sqrt(v[k]);
  return out;
}
BTMS_INLINE Lanes load(const double* from) {
  Lanes v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
BTMS_INLINE void store(const Lanes& v, double* to) { std::memcpy(to, &v, sizeof v); }

}  // namespace btms
