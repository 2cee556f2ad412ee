// Heights along lines.
#include "engine/query/profile.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/error.h"
#include "tests/engine/query/query_map.h"

namespace btms::test {
namespace {

TEST(Profile, VerticesAndStepsInBetween) {
  const auto map = std::make_shared<MemoryMap>(rolling_map(3));
  const Terrain terrain(map);
  const std::vector<Place> line = {{10, 10}, {13, 14}, {13, 14}, {13, 20.5}};  // 5 m, 0 m, 6.5 m
  const std::vector<ProfilePoint> points = profile(terrain, line, 2);
  const std::vector<double> at = {0, 2, 4, 5, 5, 6, 8, 10, 11.5};
  ASSERT_EQ(points.size(), at.size());
  for (std::size_t i = 0; i < at.size(); ++i) {
    EXPECT_NEAR(points[i].distance_m, at[i], 1e-12) << i;
    EXPECT_EQ(points[i].height.z_m, terrain.height(points[i].place).z_m) << i;
  }
  EXPECT_NEAR(points[2].place.x_m, 12.4, 1e-12);
  EXPECT_NEAR(points[2].place.y_m, 13.2, 1e-12);
  EXPECT_EQ(points[3].place, line[1]);
  EXPECT_EQ(points[8].place, line[3]);
  EXPECT_EQ(profile(terrain, line, 0).size(), 4u);
  EXPECT_EQ(profile(terrain, line, 2.5).size(), 7u) << "a vertex that is a step is one point";
  EXPECT_EQ(profile(terrain, {}, 1).size(), 0u);
  EXPECT_EQ(profile(terrain, std::vector<Place>{{3, 3}}, 1).size(), 1u);
}

// Level ground at 0; from x = 10 m on a deck over it that rises from it at 10 %.
Terrain ramp() {
  MapLayout layout{Lattice(2000), {16, {}}};
  auto map = std::make_shared<MemoryMap>(layout);
  TerrainTile tile(2000, {0, 0, 16, 1});
  std::fill(tile.corner_mm.begin(), tile.corner_mm.end(), 0);
  std::fill(tile.centre_mm.begin(), tile.centre_mm.end(), 0);
  for (NodeSurface& node : tile.nodes) node.state = NodeState::kObserved;
  for (std::int32_t col = 5; col < 16; ++col)
    for (std::uint32_t t = 0; t < kTriangles; ++t)
      tile.upper.push_back(
          {static_cast<std::uint32_t>(4 * col) + t, 200 * col - 900, 819, 0, 10, 9, UpperKind::kReachable});
  map->put({0, 0}, std::move(tile));
  return Terrain(map);
}

TEST(Profile, StaysOnItsSurface) {
  const Terrain terrain = ramp();
  const std::vector<Place> up = {{20, 1.5}, {30, 1.5}};
  EXPECT_EQ(profile(terrain, up, 1).back().height.z_m, 0);
  const std::vector<ProfilePoint> deck = profile(terrain, up, 1, 1.2);
  EXPECT_EQ(deck.front().height.surface, 1);
  EXPECT_NEAR(deck.back().height.z_m, 2, 0.01);
}

TEST(Profile, NoPlacesAndNoSteps) {
  const auto map = std::make_shared<MemoryMap>(rolling_map(1));
  const Terrain terrain(map);
  const std::vector<Place> broken = {{1, 1}, {NAN, 2}, {1e300, 1e300}, {3, 1}, {6, 1}};
  const std::vector<ProfilePoint> points = profile(terrain, broken, 1);
  ASSERT_EQ(points.size(), 7u);
  EXPECT_EQ(points[1].height.status, QueryStatus::kOutside);
  EXPECT_EQ(points[2].height.status, QueryStatus::kOutside);
  EXPECT_EQ(points[3].distance_m, 0);
  EXPECT_EQ(points[6].distance_m, 3);
  EXPECT_EQ(profile(terrain, broken, INFINITY).size(), 5u);
  for (const double step : {-1.0, 1e-300, 1e-4, double{NAN}, -double{INFINITY}})
    EXPECT_THROW(profile(terrain, broken, step), Error) << step;
  EXPECT_THROW(profile(terrain, std::vector<Place>{{0, 0}, {5e7, 0}}, 1), Error);
}

}  // namespace
}  // namespace btms::test
