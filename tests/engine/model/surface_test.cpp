// What a finished tile says of a place.
#include "engine/model/surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/model/memory_map.h"

namespace btms {
namespace {

// One square of 2 m, level at 5 m, with a deck that rises to the east and a roof over its northern triangle.
MemoryMap one_square() {
  TerrainTile tile(2000, {0, 0, 1, 1});
  tile.corner_mm = {5000, 5000, 5000, 5000};
  tile.centre_mm = {5000};
  for (NodeSurface& node : tile.nodes) node.state = NodeState::kObserved;
  NodeSurface& north = tile.nodes[kNorth];
  north.terrain_mm = 120;
  north.roughness_mm = 15;
  north.step_mm = 40;
  north.clearance_mm = 4500;
  north.cost = 127;
  north.source_level = 2;
  tile.upper = {{kNorth, 9500, 4096, 0, 20, 30, UpperKind::kReachable}, {kNorth, 15000, 0, 0, 5, 6}};
  MemoryMap map({Lattice(2000), {}});
  map.put({0, 0}, std::move(tile));
  return map;
}

TEST(Surface, LayersInMetres) {
  const MemoryMap map = one_square();
  const SurfacePoint p = surface_at(map, 1.2, 1.8);
  EXPECT_EQ(p.z_m, 5);
  EXPECT_EQ(p.terrain_m, 0.12);
  EXPECT_EQ(p.roughness_m, 0.015);
  EXPECT_EQ(p.step_m, 0.04);
  EXPECT_EQ(p.clearance_m, 4.5);
  EXPECT_EQ(p.cost, 0.5);
  EXPECT_EQ(p.source_resolution_m, 8);
  const SurfacePoint south = surface_at(map, 1.2, 0.2);
  EXPECT_EQ(south.clearance_m, INFINITY) << "nothing above";
  EXPECT_EQ(south.cost, INFINITY) << "no cost was worked out: not traversable";
  EXPECT_EQ(south.source_resolution_m, 2);
}

TEST(Surface, FurtherSurfacesOfANode) {
  const MemoryMap map = one_square();
  const auto upper = upper_surfaces_at(map, 1.2, 1.8);
  ASSERT_EQ(upper.size(), 2u);
  EXPECT_EQ(upper[0].z_m, 9.6);  // 0.2 m east of the centre
  EXPECT_EQ(upper[0].kind, UpperKind::kReachable);
  EXPECT_EQ(upper[0].sd_m, 0.02);
  EXPECT_EQ(upper[0].count, 30u);
  EXPECT_NEAR(upper[0].normal[0], -0.5 / std::sqrt(1.25), 1e-12);
  EXPECT_EQ(upper[1].z_m, 15);
  EXPECT_EQ(upper[1].kind, UpperKind::kDetached);
  EXPECT_TRUE(upper_surfaces_at(map, 1.2, 0.2).empty());
  EXPECT_TRUE(upper_surfaces_at(map, 100, 100).empty());
  EXPECT_TRUE(upper_surfaces_at(map, NAN, 0).empty());
}

}  // namespace
}  // namespace btms
