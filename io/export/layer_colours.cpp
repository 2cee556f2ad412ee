#include "io/export/layer_colours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "engine/error.h"
#include "io/export/shading.h"

namespace btms {
namespace {

constexpr Rgb kBlocked{92, 84, 100}, kNothing{222, 218, 208};
constexpr double kSteepest = 0.57735026918962576451;  // 30 degrees
constexpr double kHighestStep_mm = 500, kRoughest_mm = 200, kClear_mm = 6000;

const NodeSurface& node_of(const TerrainTile& tile, std::size_t cell, std::uint8_t triangle) {
  return tile.nodes[cell * kTriangles + triangle];
}

Rgb state_of(const TerrainTile& tile, std::size_t cell, std::uint8_t t) {
  return state_colour(node_of(tile, cell, t).state);
}
Rgb cost_of(const TerrainTile& tile, std::size_t cell, std::uint8_t t) {
  const std::uint8_t cost = node_of(tile, cell, t).cost;
  return cost == kNotTraversable ? kBlocked : ramp_colour(cost / 254.0);
}
Rgb slope_of(const TerrainTile& tile, std::size_t cell, std::uint8_t t) {
  const Gradient g = node_gradient(tile, cell, t);
  return ramp_colour(std::sqrt(g.east * g.east + g.north * g.north) / kSteepest);
}
Rgb step_of(const TerrainTile& tile, std::size_t cell, std::uint8_t t) {
  return ramp_colour(node_of(tile, cell, t).step_mm / kHighestStep_mm);
}
Rgb roughness_of(const TerrainTile& tile, std::size_t cell, std::uint8_t t) {
  return ramp_colour(node_of(tile, cell, t).roughness_mm / kRoughest_mm);
}
Rgb clearance_of(const TerrainTile& tile, std::size_t cell, std::uint8_t t) {
  const std::uint16_t mm = node_of(tile, cell, t).clearance_mm;
  return mm == kNothingAbove ? kNothing : ramp_colour(1 - mm / kClear_mm);
}

}  // namespace

std::span<const PictureLayer> picture_layers() {
  static const std::array<PictureLayer, 6> layers{{
      {"state",
       "",
       "",
       {{state_colour(NodeState::kObserved), "observed"},
        {state_colour(NodeState::kPredicted), "predicted"},
        {state_colour(NodeState::kObstacle), "obstacle"},
        {state_colour(NodeState::kFilled), "filled"}},
       state_of},
      {"cost", "0", "1", {{kBlocked, "not traversable"}}, cost_of},
      {"slope", "0", "30 deg", {}, slope_of},
      {"step", "0", "0.5 m", {}, step_of},
      {"roughness", "0", "0.2 m", {}, roughness_of},
      {"clearance", "6 m", "0", {{kNothing, "nothing above"}}, clearance_of},
  }};
  return layers;
}

const PictureLayer& picture_layer(std::string_view name) {
  std::string names;
  for (const PictureLayer& layer : picture_layers()) {
    if (layer.name == name) return layer;
    names += (names.empty() ? "" : ", ") + std::string(layer.name);
  }
  throw Error(ErrorCode::kUsage, "no layer '" + std::string(name) + "' to draw; there are " + names);
}

Rgb ramp_colour(double share) {
  // Light to dark, so that it can be read without its hues.
  constexpr std::array<Rgb, 5> kStops{{{226, 236, 205}, {250, 219, 120}, {244, 150, 62}, {204, 62, 58}, {112, 16, 70}}};
  const double at = std::clamp(share, 0.0, 1.0) * (kStops.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const double t = at - static_cast<double>(below);
  const Rgb a = kStops[below], b = kStops[below + 1];
  const auto mix = [t](std::uint8_t x, std::uint8_t y) { return static_cast<std::uint8_t>(x + (y - x) * t + 0.5); };
  return {mix(a.r, b.r), mix(a.g, b.g), mix(a.b, b.b)};
}

}  // namespace btms
