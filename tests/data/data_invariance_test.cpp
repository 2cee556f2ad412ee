// The invariance suite on real surveys: an airborne city tile, and two adjoining forest files as one map. Needs
// BTMS_DATA.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "io/points/point_file.h"
#include "tests/invariance/invariance.h"

namespace btms::test {
namespace {

std::vector<CloudPoint> read_cloud(std::initializer_list<const char*> names) {
  std::vector<CloudPoint> points;
  for (const char* name : names) {
    const auto file = open_points(std::filesystem::path(std::getenv("BTMS_DATA")) / name);
    PointBlock block;
    file->read(0, static_cast<std::size_t>(file->size()), block);
    for (std::size_t i = 0; i < block.size(); ++i) points.push_back({block.x_mm[i], block.y_mm[i], block.z_mm[i]});
  }
  return points;
}

class DataInvariance : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::getenv("BTMS_DATA")) GTEST_SKIP() << "BTMS_DATA is not set: real surveys are not here";
  }
};

TEST_F(DataInvariance, CityTile) {
  const auto points = read_cloud({"city/ahn3_delft_1.las"});
  Parameters fixed = preset("city");
  fixed.method = Method::kFixed;
  fixed.resolution_m = 8;
  expect_one_digest(points, fixed, all_ways({1, 8, 37, 0}));
  expect_one_digest(points, preset("city"), all_ways({1, 3, 0}));
}

TEST_F(DataInvariance, TwoForestFilesAsOneMap) {
  const auto points = read_cloud({"forest/bcts_1.las", "forest/bcts_2.las"});
  Parameters fixed = preset("city");
  fixed.method = Method::kFixed;
  fixed.resolution_m = 8;
  expect_one_digest(points, fixed, all_ways({1, 8, 37, 0}));
  expect_one_digest(points, preset("city"),
                    {{1, "ranks:3", "shuffled"}, {8, "tbb:2", "split"}, {5, "serial", "reversed"}});
}

}  // namespace
}  // namespace btms::test
