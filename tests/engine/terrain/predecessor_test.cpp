// Parameters for the method of the paper's predecessor: no completion, its weights.
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/error.h"
#include "engine/terrain/model_nodes.h"
#include "engine/tiling/scan_segmenter.h"
#include "engine/tiling/segment.h"
#include "tests/support/cloud.h"

#pragma GCC diagnostic ignored "-Wpsabi"  // lanes are inlined

namespace btms::test {
namespace {

// Level ground, one point every 20 cm, with a square hole.
std::vector<float> ground_with_a_hole() {
  std::vector<float> xyzi;
  for (int i = 0; i < 200; ++i)
    for (int k = 0; k < 200; ++k) {
      const float x = 0.2f * static_cast<float>(i) + 0.05f, y = 0.2f * static_cast<float>(k) + 0.05f;
      const bool hole = x > 16 && x < 24 && y > 16 && y < 24;
      // Two points of ground in the hole's middle: too few for a plane of their own.
      if (!hole || (i == 100 && (k == 100 || k == 101))) xyzi.insert(xyzi.end(), {x, y, 0, 0});
    }
  return xyzi;
}

std::size_t terrain_points(const Parameters& p) {
  const std::vector<float> xyzi = ground_with_a_hole();
  ScanSegmenter segmenter(p);
  const auto labels = segmenter.segment(interleaved(xyzi.data(), xyzi.size() / 4, 4));
  return static_cast<std::size_t>(std::count(labels.begin(), labels.end(), Label::kTerrain));
}

TEST(NoCompletion, LeavesUnseenGroundWithoutASurface) {
  Parameters p;
  p.resolution_m = 2;
  const std::size_t all = ground_with_a_hole().size() / 4;
  EXPECT_EQ(terrain_points(p), all);
  p.completion = Completion::kNone;
  EXPECT_EQ(terrain_points(p), all - 2);
}

TEST(NoCompletion, IsTheSameForScansAndMaps) {
  const CloudSource source(hard_scene(0, 0, 40'000, 30'000));
  for (const Method method : {Method::kFixed, Method::kCoarseToFine}) {
    Parameters p;
    p.method = method;
    p.levels = method == Method::kFixed ? 1 : 3;
    p.resolution_m = 2;
    const std::vector<Label> completed = segment_scan(source, p).labels;
    p.completion = Completion::kNone;
    p.node_weight = NodeWeight::kPredecessor;
    const std::vector<Label> map = segment_scan(source, p).labels;
    ScanSegmenter segmenter(p);
    const auto scan = segmenter.segment(source);
    EXPECT_TRUE(std::equal(scan.begin(), scan.end(), map.begin(), map.end()));
    EXPECT_NE(map, completed);
  }
}

Node model(const Parameters& p) {
  std::vector<std::int16_t> x, y;
  std::vector<std::int32_t> z;
  for (int i = -10; i <= 10; ++i)
    for (int k = -5; k <= 5; ++k) {
      x.push_back(static_cast<std::int16_t>(100 * i));
      y.push_back(static_cast<std::int16_t>(100 * k));
      z.push_back((i + k) % 2 == 0 ? 10 : -10);
    }
  FourPoints square;
  square[0] = {x.data(), y.data(), z.data(), x.size()};
  std::array<Node, 4> nodes;
  ModelScratch scratch;
  model_four(square, NodeModelRules(p), scratch, nodes.data());
  return nodes[0];
}

TEST(PredecessorsWeight, IsItsFormula) {
  Parameters p;
  p.node_model = NodeModel::kPca;
  p.resolution_m = 2;
  p.node_weight = NodeWeight::kPredecessor;
  // A grid of 0.1 m: variances (n^2 - 1) / 12 steps^2 along its axes, 1 cm^2 across.
  const double l1 = 0.01 * (21 * 21 - 1) / 12.0, l2 = 0.01 * (11 * 11 - 1) / 12.0, l3 = 1e-4;
  const double weight = (l1 + l2) * l2 / (l1 * l3 + 0.001) / (4 * 16);
  EXPECT_NEAR(model(p).weight / kWeightUnit, weight, 2e-3 * weight);
  p.node_weight = NodeWeight::kNormalized;
  EXPECT_NEAR(model(p).weight / kWeightUnit, (1 - l3 / l1) * (l2 - l3) / l1, 1e-3);
}

TEST(PredecessorsParameters, HaveNames) {
  Parameters p;
  set_parameter(p, "completion", "none");
  set_parameter(p, "node_weight", "predecessor");
  EXPECT_EQ(p.completion, Completion::kNone);
  EXPECT_EQ(p.node_weight, NodeWeight::kPredecessor);
  EXPECT_THROW(set_parameter(p, "completion", "bgk"), Error);
}

}  // namespace
}  // namespace btms::test
