#include "io/store/gis_layers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace btms {
namespace {
constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
}

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
  constexpr NodeState kByRank[] = {NodeState::kUnknown, NodeState::kPredicted, NodeState::kObserved,
                                   NodeState::kObstacle};
  constexpr std::uint8_t kRank[] = {0, 2, 1, 3};  // of a state
  std::uint8_t rank = 0;
  for (std::size_t t = 0; t < kTriangles; ++t)
    rank = std::max(rank, kRank[static_cast<std::uint8_t>(tile.nodes[cell * kTriangles + t].state) & 3]);
  return static_cast<std::uint8_t>(kByRank[rank]);
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
