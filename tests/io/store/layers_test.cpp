// GIS layers and chunk bytes.
#include "io/store/layers.h"

#include <cmath>
#include <numbers>

#include "engine/model/square_layers.h"
#include "io/store/chunk_codec.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

TEST(GisLayers, ArcTangentAgreesWithTheLibrary) {
  for (double t = 0; t < 1e6; t = t * 1.01 + 1e-4)
    EXPECT_NEAR(arctan_deg(t), std::atan(t) * 180 / std::numbers::pi, 1e-6) << t;
}

TEST(GisLayers, SlopeIsThatOfTheSteepestTriangle) {
  TerrainTile tile(2000, {0, 0, 1, 1});
  tile.corner_mm = {0, 0, 0, 0};
  tile.centre_mm = {1000};  // a pyramid, 1 m on 1 m
  tile.nodes[kNorth].state = NodeState::kObserved;
  EXPECT_FLOAT_EQ(square_slope_deg(tile, 0), 45);
  tile.centre_mm = {0};
  tile.corner_mm = {0, 2000, 2000, 2000};
  tile.nodes[kNorth].state = NodeState::kUnknown;
  EXPECT_TRUE(std::isnan(square_slope_deg(tile, 0)));
  tile.nodes[kSouth].state = NodeState::kPredicted;  // rises 2 m to the east, falls 2 m ... over 2 m, towards S
  EXPECT_NEAR(square_slope_deg(tile, 0), std::atan(std::sqrt(2.0)) * 180 / std::numbers::pi, 1e-5);
}

TEST(GisLayers, ClassAndDeviationOfASquare) {
  TerrainTile tile(2000, {0, 0, 1, 1});
  EXPECT_EQ(square_class(tile, 0), 0);
  EXPECT_TRUE(std::isnan(square_sd_m(tile, 0)));
  tile.nodes[3].state = NodeState::kFilled;
  EXPECT_EQ(square_class(tile, 0), 4);
  tile.nodes[3].state = NodeState::kUnknown;
  tile.nodes[0] = {NodeState::kPredicted, 0, 0, 0, 100};
  EXPECT_EQ(square_class(tile, 0), 2);
  tile.nodes[1] = {NodeState::kObserved, 0, 0, 0, 200};
  EXPECT_EQ(square_class(tile, 0), 1);
  EXPECT_FLOAT_EQ(square_sd_m(tile, 0), 0.15f);
  tile.nodes[2] = {NodeState::kObstacle, 0, 0, 0, 0};
  EXPECT_EQ(square_class(tile, 0), 3);
}

TEST(Layers, SourceLevelsNoMapHasAreRefused) {
  TerrainTile tile(2000, {0, 0, 1, 1});
  for (const LayerInfo& layer : layer_table()) {
    if (layer.id != LayerId::kSourceLevel) continue;
    scatter(layer, std::vector<std::uint8_t>{0, 1, 2, 5}, tile);
    EXPECT_EQ(tile.nodes[3].source_level, 5);
    EXPECT_EQ(thrown_code([&] {
                scatter(layer, std::vector<std::uint8_t>{0, 1, 2, 6}, tile);
              }),
              ErrorCode::kVerification);
  }
}

TEST(GisLayers, TheWorstTriangleSpeaksForItsSquare) {
  TerrainTile tile(2000, {0, 0, 2, 1});
  for (const auto value : {square_roughness_m, square_step_m, square_clearance_m, square_cost})
    EXPECT_TRUE(std::isnan(value(tile, 0)));
  EXPECT_TRUE(std::isnan(upper_elevations_m(tile)[0]));
  for (std::size_t t = 0; t < kTriangles; ++t) {
    NodeSurface& node = tile.nodes[t];
    const auto n = static_cast<std::uint16_t>(t);
    node.state = NodeState::kObserved;
    node.roughness_mm = static_cast<std::uint16_t>(10 * n);
    node.step_mm = static_cast<std::uint16_t>(1000 + 100 * n);
    node.cost = static_cast<std::uint8_t>(127 - n);
  }
  EXPECT_FLOAT_EQ(square_roughness_m(tile, 0), 0.03f);
  EXPECT_FLOAT_EQ(square_step_m(tile, 0), 1.3f);
  EXPECT_TRUE(std::isnan(square_clearance_m(tile, 0)));
  EXPECT_FLOAT_EQ(square_cost(tile, 0), 0.5f);
  tile.nodes[2].clearance_mm = 2500;
  tile.nodes[3].clearance_mm = 4000;
  EXPECT_FLOAT_EQ(square_clearance_m(tile, 0), 2.5f);
  tile.nodes[1].cost = kNotTraversable;
  EXPECT_TRUE(std::isnan(square_cost(tile, 0)));
  tile.upper = {{1, 8000}, {1, 9000}, {3, 7000}, {4, 1000}};
  EXPECT_EQ(upper_elevations_m(tile), (std::vector<float>{7, 1}));
}

TEST(ChunkCodec, ReadsBackAndNoticesDamage) {
  ChunkEncoder encoder;
  ChunkDecoder decoder;
  for (const std::size_t element : {1u, 2u, 4u})
    for (const std::size_t n : {1u, 7u, 1000u, 70001u}) {
      std::vector<std::uint8_t> values(n * element), back(values.size());
      for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<std::uint8_t>(noise(static_cast<int>(i) / 5, 0, 1));
      std::vector<std::uint8_t> stored = encoder.encode(values, element);
      ASSERT_TRUE(decoder.decode(stored, element, back));
      EXPECT_EQ(back, values);
      stored[stored.size() / 2] ^= 4;
      EXPECT_FALSE(decoder.decode(stored, element, back));
      stored[stored.size() / 2] ^= 4;
      stored.pop_back();
      EXPECT_FALSE(decoder.decode(stored, element, back));
      EXPECT_FALSE(decoder.decode({}, element, back));
    }
}

}  // namespace
}  // namespace btms
