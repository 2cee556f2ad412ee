// The picture of a map: size, orientation, colours.
#include "io/export/relief.h"

#include "engine/model/memory_map.h"
#include "io/export/picture.h"
#include "io/export/shading.h"
#include "tests/io/export/read_png.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

// Level ground, with other states where `state` says so.
MemoryMap level_map(const CellBox& box, auto&& state) {
  const MapLayout layout = layout_of(2000, 128);
  MemoryMap map(layout);
  layout.grid.for_each_tile(box, [&](TileId id) {
    TerrainTile tile(2000, layout.grid.box_of(id).intersect(box));
    std::fill(tile.corner_mm.begin(), tile.corner_mm.end(), 5000);
    std::fill(tile.centre_mm.begin(), tile.centre_mm.end(), 5000);
    for (std::int32_t row = tile.box.row0; row < tile.box.row1; ++row)
      for (std::int32_t col = tile.box.col0; col < tile.box.col1; ++col)
        for (std::uint8_t t = 0; t < kTriangles; ++t)
          tile.nodes[tile.node_index({{col, row}, t})].state = state(Cell{col, row}, t);
    map.put(id, std::move(tile));
  });
  return map;
}

TEST(Relief, NorthIsUpAndStatesHaveTheirColours) {
  const TemporaryFolder temporary;
  const auto map = level_map({-40, -30, 60, 20}, [](Cell c, std::uint8_t) {
    if (c.row >= 0 && c.col < 0) return NodeState::kObstacle;
    return c.row >= 0 ? NodeState::kPredicted : c.col < 0 ? NodeState::kObserved : NodeState::kUnknown;
  });
  write_relief(map, temporary / "a.png", 800);
  const Picture p = read_png(temporary / "a.png");
  EXPECT_EQ(p.width(), 800);  // 8 pixels a square
  EXPECT_LE(p.height(), 800);
  EXPECT_EQ(p.at(4, 4), state_colour(NodeState::kObstacle));
  EXPECT_EQ(p.at(790, 4), state_colour(NodeState::kPredicted));
  EXPECT_EQ(p.at(4, 300), state_colour(NodeState::kObserved));
  EXPECT_EQ(p.at(790, 300), Rgb{});
}

TEST(Relief, ASmallMapStandsInTheMiddleAboveAWholeLegend) {
  const TemporaryFolder temporary;
  write_relief(level_map({0, 0, 10, 10}, [](Cell, std::uint8_t) { return NodeState::kObstacle; }), temporary / "a.png");
  const Picture p = read_png(temporary / "a.png");
  EXPECT_EQ(p.at(p.width() / 2, 5), state_colour(NodeState::kObstacle));
  EXPECT_EQ(p.at(5, 5), Rgb{});
  EXPECT_EQ(p.at(p.width() - 5, 5), Rgb{});
  for (int y = 0; y < p.height(); ++y) EXPECT_EQ(p.at(p.width() - 1, y), Rgb{}) << y;  // nothing is cut off
}

TEST(Relief, TrianglesAreWhereTheyAre) {
  const TemporaryFolder temporary;
  const auto map = level_map({0, 0, 40, 30}, [](Cell, std::uint8_t t) {
    return t == kNorth ? NodeState::kObstacle : t == kEast ? NodeState::kPredicted : NodeState::kObserved;
  });
  write_relief(map, temporary / "a.png", 480);  // 12 pixels a square
  const Picture p = read_png(temporary / "a.png");
  EXPECT_EQ(p.at(5, 1), state_colour(NodeState::kObstacle));
  EXPECT_EQ(p.at(10, 5), state_colour(NodeState::kPredicted));
  EXPECT_EQ(p.at(1, 5), state_colour(NodeState::kObserved));
  EXPECT_EQ(p.at(5, 10), state_colour(NodeState::kObserved));
}

TEST(Relief, LayersColourWhatTheyMeasure) {
  const TemporaryFolder temporary;
  const MapLayout layout = layout_of(2000, 128);
  TerrainTile tile(2000, {0, 0, 40, 30});
  std::fill(tile.corner_mm.begin(), tile.corner_mm.end(), 5000);
  std::fill(tile.centre_mm.begin(), tile.centre_mm.end(), 5000);
  for (std::size_t i = 0; i < tile.nodes.size(); ++i) {
    const bool west = i / kTriangles % 40 < 20;
    tile.nodes[i].state = NodeState::kObserved;
    tile.nodes[i].cost = west ? 127 : kNotTraversable;
    tile.nodes[i].step_mm = west ? 0 : 500;
    tile.nodes[i].roughness_mm = west ? 100 : 0;
    tile.nodes[i].clearance_mm = west ? 3000 : kNothingAbove;
  }
  MemoryMap map(layout);
  map.put({0, 0}, std::move(tile));
  const auto half = ramp_colour(127 / 254.0);
  const auto drawn = [&](const char* name) {
    write_relief(map, temporary / "a.png", 1600, picture_layer(name));
    const Picture p = read_png(temporary / "a.png");
    return std::pair{p.at(p.width() / 2 - 200, 5), p.at(p.width() / 2 + 200, 5)};
  };
  EXPECT_EQ(drawn("cost").first, half);
  EXPECT_EQ(drawn("cost").second, picture_layer("cost").exceptions.at(0).colour);
  EXPECT_EQ(drawn("step"), std::pair(ramp_colour(0), ramp_colour(1)));
  EXPECT_EQ(drawn("slope"), std::pair(ramp_colour(0), ramp_colour(0)));
  EXPECT_EQ(drawn("roughness"), std::pair(half, ramp_colour(0)));
  EXPECT_EQ(drawn("clearance").first, half);
  EXPECT_EQ(drawn("clearance").second, picture_layer("clearance").exceptions.at(0).colour);
  EXPECT_EQ(drawn("state"), std::pair(state_colour(NodeState::kObserved), state_colour(NodeState::kObserved)));
  EXPECT_EQ(thrown_code([] { picture_layer("beauty"); }), ErrorCode::kUsage);
}

TEST(Relief, SlopesTowardsTheLightAreBright) {
  const Rgb level = shaded(state_colour(NodeState::kObserved), {}, 1);
  EXPECT_EQ(level, state_colour(NodeState::kObserved));
  EXPECT_GT(shaded(state_colour(NodeState::kObserved), {0.2, -0.2}, 1).g,
            level.g);  // rises to the south-east, faces north-west
  EXPECT_LT(shaded(state_colour(NodeState::kObserved), {-0.2, 0.2}, 1).g, level.g);
}

TEST(Relief, GradientsOfAllTrianglesOfAPlaneAreEqual) {
  TerrainTile tile(1000, {0, 0, 2, 2});
  for (std::int32_t row = 0; row <= 2; ++row)
    for (std::int32_t col = 0; col <= 2; ++col) tile.corner_mm[tile.corner_index({col, row})] = 200 * col - 100 * row;
  for (std::int32_t row = 0; row < 2; ++row)
    for (std::int32_t col = 0; col < 2; ++col) tile.centre_mm[tile.cell_index({col, row})] = 200 * col - 100 * row + 50;
  for (std::size_t cell = 0; cell < 4; ++cell)
    for (std::uint8_t t = 0; t < kTriangles; ++t) {
      EXPECT_DOUBLE_EQ(node_gradient(tile, cell, t).east, 0.2) << int{t};
      EXPECT_DOUBLE_EQ(node_gradient(tile, cell, t).north, -0.1) << int{t};
    }
}

TEST(Relief, LargeTinyAndEmptyMapsFit) {
  const TemporaryFolder temporary;
  const auto observed = [](Cell, std::uint8_t) { return NodeState::kObserved; };
  for (const CellBox& box : {CellBox{0, 0, 2000, 3}, CellBox{0, 0, 3, 900}, CellBox{-1, -1, 0, 0}, CellBox{}})
    for (const std::uint32_t limit : {0u, 100u, 640u, 1600u}) {
      write_relief(level_map(box, observed), temporary / "a.png", limit);
      const Picture p = read_png(temporary / "a.png");
      EXPECT_LE(p.width(), std::max(limit, 64u));
      EXPECT_LE(p.height(), std::max(limit, 64u));
    }
  EXPECT_EQ(thrown_code([&] { write_relief(level_map({}, observed), temporary / "no/such/a.png"); }),
            ErrorCode::kFailed);
}

}  // namespace
}  // namespace btms
