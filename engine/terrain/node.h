// The working record of a node n_i (paper Eq 4): mean, normal, weight, class. 24 bytes of integers: what a pass hands
// to the next, and to a neighbouring tile, has no fraction left that two computers could disagree about.
//
// Frame: mean_x, mean_y from the square's centre, mean_z absolute, millimetres. Normal in 2^-15, z component implied
// and never negative. Weight in 2^-16.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include "engine/lattice/coordinates.h"

namespace btms {

enum class NodeClass : std::uint8_t {
  kEmpty = 0,      // no points
  kNoPlane = 1,    // points, but no plane, or one that fails Eq 5
  kCandidate = 2,  // n^t before the search: passes Eq 5
  kTerrain = 3,    // n^t: its component was kept
  kRejected = 4,   // candidate whose component was not kept
  kPredicted = 5,  // n^o reverted to n^t by completion
};

struct Node {
  std::int32_t mean_z_mm = 0;  // without a plane: height of the node's lowest points
  std::int16_t mean_x_mm = 0;
  std::int16_t mean_y_mm = 0;
  std::int16_t normal_x = 0;  // 2^-15
  std::int16_t normal_y = 0;  // 2^-15
  std::uint16_t weight = 0;   // 2^-16
  NodeClass node_class = NodeClass::kEmpty;
  std::uint8_t occupied = 0;  // 1: points stand above the predicted terrain
  std::uint32_t count = 0;    // points
  std::uint16_t support = 0;  // sum of kernel values in 2^-8, saturating; 0 where observed
  std::uint16_t sd_mm = 0;    // spread of the heights behind mean_z, saturating
  friend bool operator==(const Node&, const Node&) = default;

  // n^t: takes part in corner fitting.
  bool is_terrain() const { return node_class == NodeClass::kTerrain || node_class == NodeClass::kPredicted; }
};
static_assert(sizeof(Node) == 24 && std::is_trivially_copyable_v<Node>);

inline constexpr double kNormalUnit = 32768.0;
inline constexpr double kWeightUnit = 65536.0;

// Nearest integer, halves up; the one rounding used wherever a double becomes a stored integer.
inline double round_half_up(double v) { return std::floor(v + 0.5); }

// A computed height as it is stored: nearest millimetre within the range of points.
inline std::int32_t height_mm(double z_mm) {
  constexpr double kLimit = kMaxVertical_mm;
  return static_cast<std::int32_t>(std::clamp(round_half_up(z_mm), -kLimit, kLimit));
}

inline std::uint16_t saturate_u16(double v) {
  return static_cast<std::uint16_t>(v < 65535.0 ? (v > 0.0 ? round_half_up(v) : 0.0) : 65535.0);
}

inline void set_normal(Node& n, const Eigen::Vector3d& unit) {
  n.normal_x = static_cast<std::int16_t>(std::clamp(round_half_up(unit.x() * kNormalUnit), -32767.0, 32767.0));
  n.normal_y = static_cast<std::int16_t>(std::clamp(round_half_up(unit.y() * kNormalUnit), -32767.0, 32767.0));
}

inline std::int32_t normal_xy_squared(const Node& n) {  // 2^-30
  return static_cast<std::int32_t>(std::min<std::int64_t>(
      std::int64_t{n.normal_x} * n.normal_x + std::int64_t{n.normal_y} * n.normal_y, std::int64_t{1} << 30));
}

// The unit normal s_i.
inline Eigen::Vector3d normal_of(const Node& n) {
  const double xy2 = normal_xy_squared(n);
  return {n.normal_x / kNormalUnit, n.normal_y / kNormalUnit, std::sqrt((1 << 30) - xy2) / kNormalUnit};
}

// Slope of the plane along x and y (tan). Precondition: the normal is not horizontal (every n^t passed Eq 5).
inline Eigen::Vector2d gradient_of(const Node& n) {
  const Eigen::Vector3d s = normal_of(n);
  return {-s.x() / s.z(), -s.y() / s.z()};
}

}  // namespace btms
