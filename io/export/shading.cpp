#include "io/export/shading.h"

#include <algorithm>
#include <cmath>

namespace btms {
namespace {

// Towards the light: from the north-west, 45 degrees high.
constexpr double kSunEast = -0.5, kSunNorth = 0.5, kSunUp = 0.70710678118654752;
constexpr double kAmbient = 0.25;

std::uint8_t scaled(std::uint8_t channel, double light) {
  return static_cast<std::uint8_t>(std::clamp(channel * light, 0.0, 255.0) + 0.5);
}

}  // namespace

Gradient node_gradient(const TerrainTile& tile, std::size_t cell, std::uint8_t triangle) {
  const auto cols = static_cast<std::size_t>(tile.box.cols());
  const std::size_t a = cell / cols * (cols + 1) + cell % cols;
  const std::size_t around[] = {a, a + 1, a + cols + 2, a + cols + 1};  // A, B, C, D
  constexpr std::size_t kFirst[kTriangles] = {1, 2, 3, 0};              // E = MBC, N = MCD, W = MDA, S = MAB
  const double m = tile.centre_mm[cell];
  const double p = tile.corner_mm[around[kFirst[triangle]]], q = tile.corner_mm[around[(kFirst[triangle] + 1) % 4]];
  const double r = tile.resolution_mm, out = (p + q - 2 * m) / r, along = (q - p) / r;
  switch (triangle) {
    case kEast:
      return {out, along};
    case kNorth:
      return {-along, out};
    case kWest:
      return {-out, -along};
    default:
      return {along, -out};
  }
}

Rgb state_colour(NodeState state) {
  switch (state) {
    case NodeState::kObserved:
      return {212, 200, 178};
    case NodeState::kPredicted:
      return {142, 176, 214};
    case NodeState::kObstacle:
      return {226, 98, 52};
    case NodeState::kFilled:
      return {190, 186, 196};
    default:
      return {255, 255, 255};
  }
}

Rgb shaded(Rgb base, Gradient gradient, double relief) {
  const double east = gradient.east * relief, north = gradient.north * relief;
  const double lambert =
      std::max(0.0, (kSunUp - east * kSunEast - north * kSunNorth) / std::sqrt(1 + east * east + north * north));
  const double light = kAmbient + (1 - kAmbient) * lambert / kSunUp;  // 1 on level ground
  return {scaled(base.r, light), scaled(base.g, light), scaled(base.b, light)};
}

}  // namespace btms
