#include "engine/model/difference.h"

#include <gtest/gtest.h>

#include "engine/model/digest.h"

namespace btms {
namespace {

TerrainTile flat_tile(const CellBox& box, std::int32_t height_mm = 1000) {
  TerrainTile tile(2000, box);
  for (auto* heights : {&tile.corner_mm, &tile.centre_mm}) std::fill(heights->begin(), heights->end(), height_mm);
  for (NodeSurface& node : tile.nodes) node = {NodeState::kObserved, 200, 40, 0, 12, 200, 10, 20, 3000, 7, 1};
  return tile;
}

const LayerDifference& layer(const Difference& d, CompareLayer l) { return d.layers[static_cast<std::size_t>(l)]; }

TEST(Difference, EqualTilesHaveNone) {
  const CellBox box{-3, -2, 5, 4};
  TerrainTile a = flat_tile(box);
  a.upper = {{7, 5000, 1, 2, 30, 9, UpperKind::kReachable}};
  const Difference d = difference(&a, &a, box);
  EXPECT_EQ(d.nodes, 8u * 6 * 4);
  EXPECT_EQ(d.differ, 0u);
  EXPECT_EQ(difference(nullptr, nullptr, box).nodes, 0u);
}

// Every stored field alone is a difference, as it is in the digest.
TEST(Difference, EveryFieldCounts) {
  const CellBox box{0, 0, 2, 2};
  TerrainTile a = flat_tile(box);
  a.upper = {{7, 5000, 1, 2, 30, 9, UpperKind::kReachable}};
  const auto differs = [&](CompareLayer l, std::uint64_t nodes, const auto& change) {
    TerrainTile b = a;
    change(b);
    const Difference d = difference(&a, &b, box);
    EXPECT_EQ(d.differ, nodes) << static_cast<int>(l);
    EXPECT_EQ(layer(d, l).nodes, nodes) << static_cast<int>(l);
    EXPECT_NE(digest(a), digest(b));
    for (std::size_t other = 0; other < kCompareLayers; ++other) {
      if (other != static_cast<std::size_t>(l)) {
        EXPECT_EQ(d.layers[other].nodes, 0u);
      }
    }
  };
  const auto field = [&](CompareLayer l, auto member) {
    differs(l, 1, [&](TerrainTile& b) { ++(b.nodes[5].*member); });
  };
  field(CompareLayer::kWeight, &NodeSurface::weight);
  field(CompareLayer::kCount, &NodeSurface::count);
  field(CompareLayer::kSupport, &NodeSurface::support);
  field(CompareLayer::kSd, &NodeSurface::sd_mm);
  field(CompareLayer::kTerrain, &NodeSurface::terrain_mm);
  field(CompareLayer::kRoughness, &NodeSurface::roughness_mm);
  field(CompareLayer::kStep, &NodeSurface::step_mm);
  field(CompareLayer::kClearance, &NodeSurface::clearance_mm);
  field(CompareLayer::kCost, &NodeSurface::cost);
  field(CompareLayer::kSourceLevel, &NodeSurface::source_level);
  differs(CompareLayer::kHeight, 4, [](TerrainTile& b) { b.centre_mm[0] += 3; });
  differs(CompareLayer::kHeight, 8, [](TerrainTile& b) { b.corner_mm[4] += 3; });  // in the middle: 2 of each square
  differs(CompareLayer::kUpper, 1, [](TerrainTile& b) { ++b.upper[0].z_mm; });
  differs(CompareLayer::kUpper, 1, [](TerrainTile& b) { ++b.upper[0].slope_x; });
  differs(CompareLayer::kUpper, 1, [](TerrainTile& b) { b.upper[0].kind = UpperKind::kDetached; });
  differs(CompareLayer::kUpper, 1, [](TerrainTile& b) { b.upper.clear(); });
  differs(CompareLayer::kUpper, 2, [](TerrainTile& b) { b.upper[0].node = 9; });
}

TEST(Difference, MeasuresWhatHasNumbersOnBothSides) {
  const CellBox box{0, 0, 1, 1};
  const TerrainTile a = flat_tile(box, 1000);
  TerrainTile b = flat_tile(box, 1250);
  b.nodes[0].clearance_mm = kNothingAbove;
  b.nodes[1].clearance_mm = 2000;
  const Difference d = difference(&a, &b, box);
  EXPECT_EQ(layer(d, CompareLayer::kHeight).nodes, 4u);
  EXPECT_EQ(layer(d, CompareLayer::kHeight).most, 250u);
  EXPECT_EQ(layer(d, CompareLayer::kHeight).sum, 1000u);
  EXPECT_EQ(layer(d, CompareLayer::kClearance).nodes, 2u);
  EXPECT_EQ(layer(d, CompareLayer::kClearance).measured, 1u);
  EXPECT_EQ(layer(d, CompareLayer::kClearance).most, 1000u);
}

TEST(Difference, CountsStatesAndWhatOnlyOneHas) {
  const TerrainTile a = flat_tile({0, 0, 2, 1}), wide = flat_tile({0, 0, 4, 1});
  TerrainTile b = a;
  b.nodes[3].state = NodeState::kObstacle;
  EXPECT_EQ(difference(&a, &b, a.box).states[1][3], 1u);
  EXPECT_EQ(difference(&a, &b, a.box).differ, 1u);
  const Difference grown = difference(&a, &wide, wide.box);
  EXPECT_EQ(grown.nodes, 16u);
  EXPECT_EQ(grown.differ, 8u);
  EXPECT_EQ(grown.states[0][1], 8u);
  EXPECT_EQ(difference(&wide, nullptr, wide.box).states[1][0], 16u);
  EXPECT_EQ(difference(&a, &wide, a.box).differ, 0u);  // outside the region
}

// The same content cut elsewhere: parts add up to the whole.
TEST(Difference, DoesNotDependOnBoxes) {
  const TerrainTile a = flat_tile({0, 0, 4, 4}), b = flat_tile({-2, -2, 4, 4}, 1001);
  const Difference whole = difference(&a, &b, {-2, -2, 4, 4});
  Difference parts;
  for (const CellBox& part : {CellBox{-2, -2, 1, 4}, CellBox{1, -2, 4, 2}, CellBox{1, 2, 4, 4}})
    parts += difference(&a, &b, part);
  EXPECT_EQ(parts.nodes, whole.nodes);
  EXPECT_EQ(parts.differ, whole.differ);
  EXPECT_EQ(parts.states, whole.states);
  EXPECT_EQ(layer(parts, CompareLayer::kHeight).sum, layer(whole, CompareLayer::kHeight).sum);
}

}  // namespace
}  // namespace btms
