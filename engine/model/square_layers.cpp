#include "engine/model/square_layers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace btms {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

float greatest_m(const TerrainTile& tile, std::size_t cell, std::uint16_t NodeSurface::*length_mm) {
  int greatest_mm = -1;
  for (std::size_t t = 0; t < kTriangles; ++t) {
    const NodeSurface& node = tile.nodes[cell * kTriangles + t];
    if (node.state != NodeState::kUnknown) greatest_mm = std::max<int>(greatest_mm, node.*length_mm);
  }
  return greatest_mm < 0 ? kNothing : static_cast<float>(greatest_mm / 1000.0);
}

}  // namespace

float square_elevation_m(const TerrainTile& tile, std::size_t cell) {
  const std::int32_t z_mm = tile.centre_mm[cell];
  return z_mm == kUnknownHeight_mm ? kNothing : static_cast<float>(z_mm / 1000.0);
}

float square_sd_m(const TerrainTile& tile, std::size_t cell) {
  int n = 0, sum_mm = 0;
  for (std::size_t t = 0; t < kTriangles; ++t) {
    const NodeSurface& node = tile.nodes[cell * kTriangles + t];
    if (node.state == NodeState::kUnknown) continue;
    ++n;
    sum_mm += node.sd_mm;
  }
  return n == 0 ? kNothing : static_cast<float>(sum_mm / (1000.0 * n));
}

float square_slope_deg(const TerrainTile& tile, std::size_t cell) {
  const auto cols = static_cast<std::size_t>(tile.box.cols());
  const std::size_t a = cell / cols * (cols + 1) + cell % cols;
  const std::size_t corners[] = {a, a + 1, a + cols + 2, a + cols + 1};  // A, B, C, D
  constexpr int kFirst[kTriangles] = {1, 2, 3, 0};                       // E = MBC, N = MCD, W = MDA, S = MAB
  double steepest = -1;                                                  // (tan slope * r)^2
  for (int t = 0; t < kTriangles; ++t) {
    if (tile.nodes[cell * kTriangles + t].state == NodeState::kUnknown) continue;
    const std::int32_t m = tile.centre_mm[cell];
    const std::int32_t p = tile.corner_mm[corners[kFirst[t]]], q = tile.corner_mm[corners[(kFirst[t] + 1) % 4]];
    if (m == kUnknownHeight_mm || p == kUnknownHeight_mm || q == kUnknownHeight_mm) continue;
    const double along = double(q) - p, across = double(p) + q - 2.0 * m;  // rise over one edge r, both ways
    steepest = std::max(steepest, along * along + across * across);
  }
  if (steepest < 0) return kNothing;
  return static_cast<float>(arctan_deg(std::sqrt(steepest) / tile.resolution_mm));
}

std::uint8_t square_class(const TerrainTile& tile, std::size_t cell) {
  constexpr NodeState kByRank[] = {NodeState::kUnknown, NodeState::kFilled, NodeState::kPredicted, NodeState::kObserved,
                                   NodeState::kObstacle};
  constexpr std::uint8_t kRank[] = {0, 3, 2, 4, 1};  // of a state
  std::uint8_t rank = 0;
  for (std::size_t t = 0; t < kTriangles; ++t)
    rank = std::max(rank, kRank[static_cast<std::uint8_t>(tile.nodes[cell * kTriangles + t].state)]);
  return static_cast<std::uint8_t>(kByRank[rank]);
}

float square_roughness_m(const TerrainTile& tile, std::size_t cell) {
  return greatest_m(tile, cell, &NodeSurface::roughness_mm);
}

float square_step_m(const TerrainTile& tile, std::size_t cell) { return greatest_m(tile, cell, &NodeSurface::step_mm); }

float square_clearance_m(const TerrainTile& tile, std::size_t cell) {
  std::uint16_t least_mm = kNothingAbove;
  for (std::size_t t = 0; t < kTriangles; ++t)
    least_mm = std::min(least_mm, tile.nodes[cell * kTriangles + t].clearance_mm);
  return least_mm == kNothingAbove ? kNothing : static_cast<float>(least_mm / 1000.0);
}

float square_cost(const TerrainTile& tile, std::size_t cell) {
  std::uint8_t greatest = 0;
  for (std::size_t t = 0; t < kTriangles; ++t) greatest = std::max(greatest, tile.nodes[cell * kTriangles + t].cost);
  return greatest == kNotTraversable ? kNothing : static_cast<float>(greatest / 254.0);
}

std::vector<float> upper_elevations_m(const TerrainTile& tile) {
  std::vector<float> lowest(static_cast<std::size_t>(tile.box.cells()), kNothing);
  for (const UpperNode& u : tile.upper) {
    float& z_m = lowest[u.node / kTriangles];
    z_m = std::fmin(z_m, static_cast<float>(u.z_mm / 1000.0));  // not NaN where one is a number
  }
  return lowest;
}

double arctan_deg(double t) {
  const bool inverted = t > 1;
  if (inverted) t = 1 / t;
  // atan t = pi/6 + atan u brings u below tan(pi/12), where six terms of the series are enough.
  constexpr double kTan30 = 0.57735026918962576451, kTan15 = 0.26794919243112270647;
  const bool shifted = t > kTan15;
  const double u = shifted ? (t - kTan30) / (1 + t * kTan30) : t, u2 = u * u;
  constexpr double kTerms[] = {-1.0 / 11, 1.0 / 9, -1.0 / 7, 1.0 / 5, -1.0 / 3, 1.0};
  double series = 0;
  for (const double term : kTerms) series = term + u2 * series;
  double rad = u * series;
  if (shifted) rad += std::numbers::pi / 6;
  if (inverted) rad = std::numbers::pi / 2 - rad;
  return rad * (180 / std::numbers::pi);
}

}  // namespace btms
