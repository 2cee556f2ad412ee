// Steps and costs of built maps.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/model/surface.h"
#include "engine/model/traversability.h"
#include "engine/tiling/segment.h"
#include "tests/invariance/invariance.h"

namespace btms::test {
namespace {

// Level ground with a low wall at x = 20 m, 40 x 40 m, 25 points per m^2.
std::vector<CloudPoint> terrace(std::int32_t height_mm) {
  std::vector<CloudPoint> points;
  for (std::int64_t y = 100; y < 40'000; y += 200)
    for (std::int64_t x = 100; x < 40'000; x += 200) points.push_back({x, y, x < 20'000 ? 1000 : 1000 + height_mm});
  return points;
}

Parameters small_car() {
  Parameters p = preset("paper-partial-map");
  p.normal_similarity = p.plane_distance = 1;  // the terrace stays one component
  p.vehicle_width_m = 1.8;
  p.vehicle_max_step_m = 0.2;
  return p;
}

TEST(LayerPass, ALowWallIsAStepThatStopsACarNearItAndNowhereElse) {
  const MemoryMap map = build_plain(terrace(400), small_car(), 8);
  double highest_m = 0;
  for (double y = 10; y < 30; y += 0.7)
    for (double x = 6; x < 34; x += 0.3) {
      const SurfacePoint p = surface_at(map, x, y);
      const double off = std::abs(x - 20);
      highest_m = std::max(highest_m, p.step_m);
      if (off > 3) {
        EXPECT_EQ(p.step_m, 0) << x;
        EXPECT_LT(p.cost, 0.05) << x;
      }
      if (off < 0.6) {
        EXPECT_EQ(p.cost, INFINITY) << x;
      }
    }
  EXPECT_NEAR(highest_m, 0.4, 0.05);
}

TEST(LayerPass, ALowerOneCostsButLetsPass) {
  const MemoryMap map = build_plain(terrace(120), small_car(), 8);
  double highest = 0;
  for (double x = 6; x < 34; x += 0.3) highest = std::max(highest, surface_at(map, x, 20.5).cost);
  EXPECT_NEAR(highest, 0.6, 0.1);  // 0.12 of 0.2 m
}

TEST(LayerPass, AScanThatIsOnlyLabelledHasNone) {
  const SegmentedScan scan = segment_scan(CloudSource(terrace(400)), small_car());
  for (const TileId id : scan.map.tiles())
    for (const NodeSurface& node : scan.map.load(id)->nodes)
      ASSERT_TRUE(node.step_mm == 0 && node.cost == kNotTraversable);
}

// Every node, from nothing but the finished map.
TEST(LayerPass, ANodeIsTraversableWhenAllUnderTheVehicleIs) {
  for (const double width_m : {0.0, 1.8, 7.0}) {
    Parameters p = preset("city");
    p.levels = 3;
    p.vehicle_width_m = width_m;
    const Vehicle vehicle(p);
    const MemoryMap map = build_plain(hard_scene(-40'000, 3'000, 90'000, 30'000), p, 4);
    const auto own_cost = [&](NodeId n) -> int {
      const auto tile = map.load(map.layout().grid.tile_of(n.cell));
      if (!tile || !tile->box.contains(n.cell)) return kNotTraversable;
      const NodeSurface& node = tile->nodes[tile->node_index(n)];
      if (node.state == NodeState::kUnknown) return kNotTraversable;
      return vehicle.cost(node, FinalPlane::through(n.triangle, tile->corners_mm(n)));
    };
    std::size_t free = 0, blocked = 0;
    for (const TileId id : map.tiles()) {
      const auto tile = map.load(id);
      for (std::int32_t row = tile->box.row0; row < tile->box.row1; ++row)
        for (std::int32_t col = tile->box.col0; col < tile->box.col1; ++col)
          for (std::uint8_t t = 0; t < kTriangles; ++t) {
            int expected = own_cost({{col, row}, t});
            for (const NodeOffset& o : vehicle.footprint(t))
              if (own_cost({{col + o.col, row + o.row}, o.triangle}) == kNotTraversable) expected = kNotTraversable;
            ASSERT_EQ(tile->nodes[tile->node_index({{col, row}, t})].cost, expected) << col << ' ' << row;
            ++(expected == kNotTraversable ? blocked : free);
          }
    }
    EXPECT_GT(free, 100u) << width_m;
    EXPECT_GT(blocked, 100u) << width_m;
  }
}

TEST(LayerPass, AVehicleThatIsTooWideForTheLatticeIsRefused) {
  Parameters p;
  p.resolution_m = 0.5;
  p.vehicle_width_m = 16;
  check(p);
  p.vehicle_width_m = 16.1;
  EXPECT_THROW(check(p), std::exception);
}

}  // namespace
}  // namespace btms::test
