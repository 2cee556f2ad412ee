// Heights as planners ask for them.
#include "engine/query/terrain.h"

#include <gtest/gtest.h>

#include <bit>

#include "tests/engine/query/query_map.h"

namespace btms {
namespace {

using test::CountingMap;
using test::rolling_map;

std::vector<Place> places_around(std::size_t n) {
  test::Random random(3);
  std::vector<Place> places;
  for (std::size_t i = 0; i < n; ++i)
    places.push_back({static_cast<double>(random.between(-5000, 110000)) / 1000,
                      static_cast<double>(random.between(-5000, 110000)) / 1000});
  return places;
}

bool same_bits(const HeightAnswer& a, const HeightAnswer& b) {
  const auto bits = [](double v) { return std::bit_cast<std::uint64_t>(v); };
  return a.status == b.status && a.state == b.state && a.surface == b.surface && a.surfaces == b.surfaces &&
         bits(a.z_m) == bits(b.z_m) && bits(a.variance_m2) == bits(b.variance_m2) &&
         bits(a.normal[0]) == bits(b.normal[0]) && bits(a.normal[2]) == bits(b.normal[2]);
}

TEST(Terrain, AnswersAreThoseOfTheSurface) {
  const MemoryMap map = rolling_map(3);
  const Terrain terrain(std::make_shared<CountingMap>(map));
  int known = 0, unknown = 0, outside = 0;
  for (const Place p : places_around(3000)) {
    const HeightAnswer a = terrain.height(p);
    const SurfacePoint s = surface_at(map, p.x_m, p.y_m);
    if (a.status == QueryStatus::kOk) {
      ++known;
      ASSERT_EQ(a.z_m, s.z_m);
      ASSERT_EQ(a.variance_m2, s.sd_m * s.sd_m);
      ASSERT_EQ(a.normal[0], s.normal[0]);
      ASSERT_EQ(a.cost, static_cast<float>(s.cost));
      ASSERT_EQ(a.surfaces, 1 + upper_surfaces_at(map, p.x_m, p.y_m).size());
      ASSERT_EQ(a.surface, 0);
    } else {
      ASSERT_EQ(s.state, NodeState::kUnknown);
      ASSERT_TRUE(std::isnan(a.z_m));
      const bool inside = p.x_m >= -0.0005 && p.y_m >= -0.0005 && p.x_m < 95.9995 && p.y_m < 95.9995;
      ASSERT_EQ(a.status, inside ? QueryStatus::kUnknown : QueryStatus::kOutside) << p.x_m << " " << p.y_m;
      ++(inside ? unknown : outside);
    }
    ASSERT_EQ(a.state, s.state);
  }
  EXPECT_GT(known, 1000);
  EXPECT_GT(unknown, 50);
  EXPECT_GT(outside, 50);
}

TEST(Terrain, ManyAreAsOne) {
  const MemoryMap map = rolling_map(3);
  const Terrain terrain(std::make_shared<CountingMap>(map));
  std::vector<Place> places = places_around(2000);
  places.push_back({NAN, 1});
  places.push_back({INFINITY, 1});
  std::vector<double> hints(places.size());
  for (std::size_t i = 0; i < hints.size(); ++i) hints[i] = i % 3 == 0 ? kNoHint : static_cast<double>(i % 11);
  std::vector<HeightAnswer> plain(places.size()), hinted(places.size());
  terrain.heights(places, plain);
  terrain.heights(places, hints, hinted);
  for (std::size_t i = 0; i < places.size(); ++i) {
    ASSERT_TRUE(same_bits(plain[i], terrain.height(places[i]))) << i;
    ASSERT_TRUE(same_bits(hinted[i], terrain.height(places[i], hints[i]))) << i;
  }
}

// Level ground at 5 m; a ramp over the north, which joins it somewhere, and a roof.
Terrain bridged(NodeState ground) {
  MapLayout layout{Lattice(2000), {1, {}}};
  auto map = std::make_shared<MemoryMap>(layout);
  TerrainTile tile(2000, {0, 0, 1, 1});
  tile.corner_mm = {5000, 5000, 5000, 5000};
  tile.centre_mm = {5000};
  for (NodeSurface& node : tile.nodes) node.state = ground;
  tile.upper = {{kNorth, 9500, 0, 0, 20, 30, UpperKind::kReachable}, {kNorth, 15000, 0, 0, 5, 6, UpperKind::kDetached}};
  map->put({0, 0}, std::move(tile));
  return Terrain(map);
}

TEST(Terrain, AHintChoosesAmongSurfaces) {
  const Terrain terrain = bridged(NodeState::kObserved);
  const Place north{1, 1.8};
  EXPECT_EQ(terrain.height(north).z_m, 5);
  EXPECT_EQ(terrain.height(north).surfaces, 3);
  EXPECT_EQ(terrain.height(north, 6).z_m, 5);
  EXPECT_EQ(terrain.height(north, 9).surface, 1);
  EXPECT_EQ(terrain.height(north, 9).z_m, 9.5);
  EXPECT_EQ(terrain.height(north, 9).variance_m2, 0.02 * 0.02);
  EXPECT_TRUE(std::isnan(terrain.height(north, 9).cost));
  EXPECT_EQ(terrain.height(north, 1e9).z_m, 15);
  EXPECT_EQ(terrain.height(north, 1e9).cost, INFINITY);
  EXPECT_EQ(terrain.height({1, 0.2}, 9).z_m, 5) << "nothing above the south";
}

TEST(Terrain, WithoutGroundTheLowestThatJoinsIt) {
  const Terrain terrain = bridged(NodeState::kUnknown);
  const HeightAnswer a = terrain.height({1, 1.8});
  EXPECT_EQ(a.status, QueryStatus::kOk);
  EXPECT_EQ(a.surface, 1);
  EXPECT_EQ(a.surfaces, 2);
  EXPECT_EQ(a.state, NodeState::kUnknown);
  EXPECT_EQ(terrain.height({1, 1.8}, 20).z_m, 15);
  EXPECT_EQ(terrain.height({1, 0.2}).status, QueryStatus::kUnknown);
  EXPECT_EQ(terrain.detail({1, 1.8}).upper.size(), 2u);
}

TEST(Terrain, ADamagedTileIsAnAnswer) {
  const MemoryMap map = rolling_map(2);
  const auto source = std::make_shared<CountingMap>(map);
  source->refuse = true;
  const Terrain terrain(source);
  EXPECT_EQ(terrain.height({40, 40}).status, QueryStatus::kDamaged);
  const std::vector<Place> both = {{40, 40}, {3, 3}};
  std::vector<HeightAnswer> answers(2);
  terrain.heights(both, answers);
  EXPECT_EQ(answers[0].status, QueryStatus::kDamaged);
  EXPECT_NE(answers[1].status, QueryStatus::kDamaged);
  EXPECT_THROW(terrain.detail({40, 40}), Error);
}

}  // namespace
}  // namespace btms
