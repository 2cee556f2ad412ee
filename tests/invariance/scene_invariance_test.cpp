// The promise no peer proves: the tiled map equals the untiled map bit for bit, for any tile edge, executor, thread and
// rank count, order and splitting of the inputs. tests/mutants.sh breaks the engine on purpose and sees this fail.
#include <gtest/gtest.h>

#include "engine/error.h"
#include "tests/invariance/invariance.h"

namespace btms::test {
namespace {

constexpr std::int64_t kSize_mm = 90'000;
constexpr std::size_t kPoints = 60'000;

Parameters small_nodes(CompletionNormals normals, NodeModel model) {
  Parameters p = preset("paper-partial-map");
  p.min_points = 4;
  p.kernel_radius = 2.5;
  p.completion_normals = normals;
  p.node_model = model;
  p.vehicle_width_m = 5;  // reaches two squares
  return p;
}

// 0 = the whole map is one tile
const std::vector<std::int32_t> kEdges = {1, 8, 37, 0};

// No completion, and its unbounded weights.
TEST(InvarianceScene, OfThePredecessorsMode) {
  Parameters p = small_nodes(CompletionNormals::kPlane, NodeModel::kRobust);
  p.completion = Completion::kNone;
  p.node_weight = NodeWeight::kPredecessor;
  expect_one_digest(hard_scene(0, 0, kSize_mm, kPoints), p, all_ways({8, 0}));
}

TEST(InvarianceScene, AtUtmCoordinates) {
  expect_one_digest(hard_scene(352'123'456, 5'744'987'654, kSize_mm, kPoints),
                    small_nodes(CompletionNormals::kPlane, NodeModel::kRobust), all_ways(kEdges));
}

TEST(InvarianceScene, InTheNegativeQuadrant) {
  expect_one_digest(hard_scene(-90'000'001, -7'123'457, kSize_mm, kPoints, 2),
                    small_nodes(CompletionNormals::kFaithful, NodeModel::kRobust), all_ways(kEdges));
}

// Coarse to fine: 16, 8, 4 and 2 m, every level with its own halos, rounds and verdicts.
Parameters levels_of_city() {
  Parameters p = preset("city");
  p.levels = 4;
  return p;
}

TEST(InvarianceScene, CoarseToFineAtUtmCoordinates) {
  expect_one_digest(hard_scene(352'123'456, 5'744'987'654, 200'000, kPoints), levels_of_city(), all_ways({1, 3, 8, 0}));
}

TEST(InvarianceScene, CoarseToFineInTheNegativeQuadrant) {
  expect_one_digest(hard_scene(-90'000'001, -7'123'457, 150'000, kPoints, 2), levels_of_city(), all_ways({1, 5, 0}));
}

// Levels of a scanner's map, down to the smallest squares there can be; the finest fit follows the ground's scatter.
TEST(InvarianceScene, CoarseToFineBelowAMetre) {
  Parameters p = preset("partial-map");
  p.resolution_m = 0.1;
  p.vehicle_width_m = 0.5;
  expect_one_digest(hard_scene(352'123'456, 5'744'987'654, 9'000, 15'000), p, all_ways({1, 3, 0}));
}

// Spans, sheets and their components over every border.
TEST(InvarianceScene, CoarseToFineWithABridgeARoofAndAWood) {
  // The last tile that holds a part of the deck has only a few of its joints to the bank.
  const std::vector<CloudPoint> points = BridgeScene::points(352'123'456, 5'744'983'154, 80'000);
  std::size_t reachable = 0, detached = 0;
  const MemoryMap map = build_plain(points, levels_of_city(), 2);
  for (const TileId id : map.tiles())
    for (const UpperNode& u : map.load(id)->upper) ++(u.kind == UpperKind::kReachable ? reachable : detached);
  EXPECT_GT(reachable, 200u) << "the deck";
  EXPECT_GT(detached, 400u) << "the roof";
  expect_one_digest(points, levels_of_city(), all_ways({1, 3, 0}));
}

TEST(InvarianceScene, AcrossAllQuadrants) {
  expect_one_digest(hard_scene(-45'001, -43'999, kSize_mm, kPoints, 3),
                    small_nodes(CompletionNormals::kPlane, NodeModel::kPca), all_ways({8, 0}));
}

// Rows of squares 1 mm apart in height with an empty row between them, every square with the same mirrored points: what
// lies north and south of an empty node weighs exactly the same, so its height is exactly half a millimetre between two
// integers, and any sum that depends on the order of its terms falls to one side or the other.
std::vector<CloudPoint> scene_of_ties() {
  constexpr std::int64_t r = 2000, size = 24;
  std::vector<CloudPoint> points;
  for (std::int64_t row = 0; row < size; ++row) {
    if (row % 6 == 3) continue;
    const auto z = static_cast<std::int32_t>(123'456 + (row + 3) / 6 % 2);
    for (std::int64_t col = 0; col < size; ++col)
      for (const std::int64_t out : {450, 700})
        for (const std::int64_t across : {-260, -110, 110, 260})
          for (const auto& [u, v] : {std::pair{out, across}, {across, out}, {-out, across}, {across, -out}})
            points.push_back({col * r + r / 2 + u, row * r + r / 2 + v, z});
  }
  return points;
}

TEST(InvarianceScene, OfTies) {
  expect_one_digest(scene_of_ties(), small_nodes(CompletionNormals::kFaithful, NodeModel::kRobust),
                    all_ways({1, 8, 0}));
}

TEST(InvarianceScene, MovedByWholeTilesItIsTheSameMap) {
  const Parameters p = small_nodes(CompletionNormals::kPlane, NodeModel::kRobust);
  constexpr std::int32_t kTile = 8;
  constexpr std::int64_t tile_mm = kTile * 2000, dx = 22'008, dy = 359'064;  // tiles, whole bins; to UTM coordinates
  const MemoryMap here = build_plain(hard_scene(0, 0, kSize_mm, kPoints), p, kTile);
  const MemoryMap there = build_plain(hard_scene(dx * tile_mm, dy * tile_mm, kSize_mm, kPoints), p, kTile);
  ASSERT_EQ(here.tiles().size(), there.tiles().size());
  for (const TileId id : here.tiles()) {
    const auto a = here.load(id);
    const auto b = there.load({static_cast<std::int32_t>(id.tx + dx), static_cast<std::int32_t>(id.ty + dy)});
    ASSERT_TRUE(b);
    EXPECT_TRUE(a->corner_mm == b->corner_mm && a->centre_mm == b->centre_mm && a->nodes == b->nodes)
        << id.tx << ' ' << id.ty;
  }
}

TEST(InvarianceScene, StrayPointsFarAwayChangeNothingElseAndCostLittle) {
  const std::vector<CloudPoint> scene = hard_scene(0, 0, kSize_mm, kPoints);
  std::vector<CloudPoint> points = scene;
  for (std::int64_t i = 1; i <= 20; ++i)
    points.push_back({i * 400'000, -i * 300'000, 12345});  // up to 10 km, further out they are left out as astray
  const Parameters p = small_nodes(CompletionNormals::kPlane, NodeModel::kRobust);
  const MemoryMap without = build_plain(scene, p, 128), with = build_plain(points, p, 128);
  for (const TileId id : without.tiles()) {
    const auto a = without.load(id), b = with.load(id);
    ASSERT_TRUE(b);
    EXPECT_EQ(digest(*a), digest(*b));
  }
  std::int64_t nodes = 0, more = 0;
  for (const TileId id : without.tiles()) nodes += static_cast<std::int64_t>(without.load(id)->nodes.size());
  for (const TileId id : with.tiles()) more += static_cast<std::int64_t>(with.load(id)->nodes.size());
  EXPECT_LT(more - nodes, 20 * 40 * 40 * 4) << "a stray costs its bin and the reach of a prediction";

  const std::string serial = fingerprint(points, p, {8, "serial", "as is"});
  EXPECT_EQ(fingerprint(points, p, {128, "ranks:2", "reversed"}), serial.substr(0, 32));
  EXPECT_EQ(fingerprint(points, p, {37, "tbb:2", "as is"}), serial);
}

TEST(InvarianceScene, WiderThanOneTileCanBe) {
  // Two patches 2147.4 km apart: positions inside one whole tile would leave 32 bits of millimetres.
  std::vector<CloudPoint> points = hard_scene(0, 0, 30'000, 8'000);
  const std::vector<CloudPoint> far = hard_scene(2'147'400'000, 0, 30'000, 8'000, 5);
  points.insert(points.end(), far.begin(), far.end());
  Parameters p = preset("city");
  p.min_points = 4;
  expect_one_digest(points, p, {{128, "serial", "as is"}, {128, "tbb:2", "shuffled"}, {0, "serial", "as is"}});
}

}  // namespace
}  // namespace btms::test
