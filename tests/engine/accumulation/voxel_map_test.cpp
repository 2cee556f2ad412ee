#include "engine/accumulation/voxel_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <tuple>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"

namespace btms {
namespace {

std::vector<AccumulatedPoint> random_points(std::size_t n) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> xy(-1000, 1000), z(-300, 300), kind(0, 4);
  std::vector<AccumulatedPoint> points;
  for (std::size_t i = 0; i < n; ++i)
    points.push_back(
        {400'000'000 + xy(random), -5'000'000'000 + xy(random), z(random), static_cast<PointKind>(kind(random))});
  return points;
}

using Place = std::tuple<std::int64_t, std::int64_t, std::int32_t, PointKind>;
std::vector<Place> places(const VoxelMap& map) {
  std::vector<Place> out;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const AccumulatedPoint p = map.point(i);
    out.emplace_back(p.x_mm, p.y_mm, p.z_mm, p.kind);
  }
  return out;
}

TEST(VoxelMap, HoldsTheCentroidAndTheMajorityOfEachVoxel) {
  constexpr std::int64_t kEdge = 200;
  const auto points = random_points(5000);
  struct Sum {
    std::int64_t x = 0, y = 0, z = 0, n = 0;
    std::array<int, kPointKinds> votes{};
  };
  std::map<std::array<std::int64_t, 3>, Sum> sums;  // z, y, x
  for (const AccumulatedPoint& p : points) {
    Sum& s = sums[{floor_div(p.z_mm, kEdge), floor_div(p.y_mm, kEdge), floor_div(p.x_mm, kEdge)}];
    s.x += p.x_mm, s.y += p.y_mm, s.z += p.z_mm, ++s.n;
    ++s.votes[static_cast<std::size_t>(p.kind)];
  }
  VoxelMap map(kEdge);
  map.add(points);
  ASSERT_EQ(map.size(), sums.size());
  std::size_t i = 0;
  for (const auto& [voxel, s] : sums) {
    const AccumulatedPoint p = map.point(i++);
    const auto n = static_cast<double>(s.n);
    EXPECT_NEAR(static_cast<double>(p.x_mm), static_cast<double>(s.x) / n, 0.5);
    EXPECT_NEAR(static_cast<double>(p.y_mm), static_cast<double>(s.y) / n, 0.5);
    EXPECT_NEAR(static_cast<double>(p.z_mm), static_cast<double>(s.z) / n, 0.5);
    const auto votes = [&](PointKind kind) { return s.votes[static_cast<std::size_t>(kind)]; };
    const bool ambiguous = p.kind == PointKind::kAmbiguousLow || p.kind == PointKind::kAmbiguousHigh;
    const int both = votes(PointKind::kAmbiguousLow) + votes(PointKind::kAmbiguousHigh);
    const int most =
        std::max({votes(PointKind::kTerrain), votes(PointKind::kObject), votes(PointKind::kIgnored), both});
    EXPECT_EQ(ambiguous ? both : votes(p.kind), most);
    if (ambiguous) {
      EXPECT_GE(votes(p.kind), both - votes(p.kind));
    }
  }
}

TEST(VoxelMap, DependsNeitherOnOrderNorOnPortions) {
  auto points = random_points(3000);
  VoxelMap whole(200), parts(200);
  whole.add(points);
  std::shuffle(points.begin() + 1, points.end(), std::mt19937(3));
  for (std::size_t i = 0; i < points.size(); i += 700)
    parts.add(std::span(points).subspan(i, std::min<std::size_t>(700, points.size() - i)));
  EXPECT_EQ(places(whole), places(parts));
}

TEST(VoxelMap, TiesGoToTerrain) {
  VoxelMap map(1000);
  const AccumulatedPoint points[] = {{1, 1, 1, PointKind::kIgnored},
                                     {3, 1, 1, PointKind::kAmbiguousHigh},
                                     {1, 5, 1, PointKind::kObject},
                                     {1, 1, 9, PointKind::kTerrain}};
  map.add(points);
  ASSERT_EQ(map.size(), 1u);
  EXPECT_EQ(map.point(0).kind, PointKind::kTerrain);
}

TEST(VoxelMap, RefusesPointsThatCannotBelongTogether) {
  VoxelMap map(10);
  const AccumulatedPoint near{0, 0, 0, PointKind::kObject}, far{11'000'000, 0, 0, PointKind::kObject};
  map.add({&near, 1});
  EXPECT_THROW(map.add({&far, 1}), Error);
}

}  // namespace
}  // namespace btms
