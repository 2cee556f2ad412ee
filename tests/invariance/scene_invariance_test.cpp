// The promise no peer proves: the tiled map equals the untiled map bit for bit, for any tile edge, executor, thread and
// rank count, order and splitting of the inputs. tests/mutants.sh breaks the engine in eight ways and sees this fail.
#include <gtest/gtest.h>

#include "engine/error.h"
#include "tests/invariance/invariance.h"

namespace btms::test {
namespace {

constexpr std::int64_t kSize_mm = 90'000;
constexpr std::size_t kPoints = 60'000;

Parameters small_nodes(CompletionNormals normals, NodeModel model) {
  Parameters p = preset("partial-map");
  p.min_points = 4;
  p.kernel_radius = 2.5;
  p.completion_normals = normals;
  p.node_model = model;
  return p;
}

// 0 = the whole map is one tile
const std::vector<std::int32_t> kEdges = {1, 8, 37, 0};

TEST(InvarianceScene, AtUtmCoordinates) {
  expect_one_digest(hard_scene(352'123'456, 5'744'987'654, kSize_mm, kPoints),
                    small_nodes(CompletionNormals::kPlane, NodeModel::kRobust), all_ways(kEdges));
}

TEST(InvarianceScene, InTheNegativeQuadrant) {
  expect_one_digest(hard_scene(-90'000'001, -7'123'457, kSize_mm, kPoints, 2),
                    small_nodes(CompletionNormals::kFaithful, NodeModel::kRobust), all_ways(kEdges));
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
  expect_one_digest(scene_of_ties(), small_nodes(CompletionNormals::kFaithful, NodeModel::kRobust), all_ways({1, 8, 0}));
}

TEST(InvarianceScene, MovedByAMultipleOfTheResolutionItIsTheSameMap) {
  // Heights equal bit for bit; the digest has the place in it, so compare labels.
  const Parameters p = small_nodes(CompletionNormals::kPlane, NodeModel::kRobust);
  const Way way{8, "serial", "as is"};
  const std::string here = fingerprint(hard_scene(0, 0, kSize_mm, kPoints), p, way);
  const std::string there = fingerprint(hard_scene(352'124'000, 5'744'988'000, kSize_mm, kPoints), p, way);
  EXPECT_EQ(here.substr(32), there.substr(32));
  EXPECT_NE(here.substr(0, 32), there.substr(0, 32));
}

TEST(InvarianceScene, StrayPointsFarAwayChangeNothingElseAndCostLittle) {
  std::vector<CloudPoint> points = hard_scene(0, 0, kSize_mm, kPoints);
  for (std::int64_t i = 1; i <= 20; ++i) points.push_back({i * 400'000'000, -i * 300'000'000, 12345});  // up to 10 000 km
  const Parameters p = small_nodes(CompletionNormals::kPlane, NodeModel::kRobust);
  const std::string serial = fingerprint(points, p, {8, "serial", "as is"});
  EXPECT_EQ(fingerprint(points, p, {37, "tbb:2", "as is"}), serial);
  EXPECT_EQ(fingerprint(points, p, {128, "ranks:2", "reversed"}), serial.substr(0, 32));
  EXPECT_THROW(fingerprint(points, p, {0, "serial", "as is"}), Error);  // one dense tile over 10 000 km
}

}  // namespace
}  // namespace btms::test
