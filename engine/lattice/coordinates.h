// Integer map coordinates: the one unit of the whole program is the millimetre.
//
// Points are rounded once, where they are read (nearest millimetre). From there on x and y are int64 and z is int32
// millimetres in the map frame (x east, y north, z up), so cells, keys, moments and distances are exact.
#pragma once

#include <cstdint>

namespace btms {

// |x|, |y| <= 68 719 km: every projected coordinate on Earth, and cells of 0.1 m still fit 30 bits.
inline constexpr std::int64_t kMaxHorizontal_mm = std::int64_t{1} << 36;
// |z| <= 134 km: 2000 products of a 24-bit kernel value and a height sum below 2^62.
inline constexpr std::int32_t kMaxVertical_mm = std::int32_t{1} << 27;

// Quotient rounded towards minus infinity; b > 0. Truncation would fold the quadrants around zero onto each other.
constexpr std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  const std::int64_t q = a / b;
  return q - ((a % b) < 0 ? 1 : 0);
}
constexpr std::int64_t ceil_div(std::int64_t a, std::int64_t b) { return -floor_div(-a, b); }

}  // namespace btms
