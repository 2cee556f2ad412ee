// The working record of a node in the coarse-to-fine method. 24 bytes of integers, like Node.
#pragma once

#include <algorithm>
#include <cstdint>
#include <type_traits>

#include "engine/terrain/node.h"

namespace btms {

enum class LevelClass : std::uint8_t {
  kOutside = 0,   // not part of the map: too far from any point
  kEmpty = 1,     // no point, or none that counts
  kThin = 2,      // points, but too little weight for a plane
  kNear = 3,      // plane close to the prior
  kAbove = 4,     // plane above the prior
  kRejected = 5,  // plane whose component is not terrain
  kSpan = 6,      // over or under a bridge deck; the ground is known from both sides (span.h)
};

struct LevelNode {
  std::int32_t mean_z_mm = 0;
  std::int16_t mean_x_mm = 0, mean_y_mm = 0;  // from the square's centre
  std::int16_t slope_x = 0, slope_y = 0;      // 2^-13
  std::uint16_t weight = 0;                   // 2^-16
  std::uint16_t sd_mm = 0;                    // uncertainty u, saturating
  std::int16_t above_prior_mm = 0;            // d, saturating
  std::uint16_t tolerance_mm = 0;             // t, saturating
  LevelClass level_class = LevelClass::kOutside;
  std::uint8_t source = 0;  // levels coarser than this one that the height comes from
  std::uint16_t count = 0;  // points, saturating

  bool has_plane() const { return level_class == LevelClass::kNear || level_class == LevelClass::kAbove; }
};
static_assert(sizeof(LevelNode) == 24 && std::is_trivially_copyable_v<LevelNode>);

inline constexpr double kSlopeUnit = 8192.0;

inline std::int16_t stored_slope(double tangent) {
  return static_cast<std::int16_t>(std::clamp(round_half_up(tangent * kSlopeUnit), -32767.0, 32767.0));
}

}  // namespace btms
