// What keeps the moments of a node's points (sums of coordinates and of their products) exact in 63 bits.
#pragma once

#include <cstdint>

namespace btms {

inline constexpr std::int32_t kMaxNodeRelief_mm = 1 << 18;       // heights from the node's datum are clamped to this
inline constexpr std::uint32_t kMaxNodePoints = (1u << 27) - 1;  // more in one node are refused

}  // namespace btms
