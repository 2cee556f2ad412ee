// Files of the field, where they are at hand: BTMS_DATA names their folder.
#include <cmath>
#include <limits>

#include "tests/io/points/files.h"

namespace btms::test {
namespace {

class RealData : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("BTMS_DATA");
    if (folder == nullptr) GTEST_SKIP() << "BTMS_DATA is not set: no real files to read";
    data = folder;
  }
  std::filesystem::path at(const std::string& name) const { return data / name; }
  std::filesystem::path data;
};

#define REQUIRE_FILE(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << (path) << " is not there"

TEST_F(RealData, LasPointsLieInTheirDeclaredBox) {
  for (const char* name : {"city/ahn3_delft_1.las", "city/nrw_291_5744.las", "lake/topography.las",
                           "feet/autzen_trim.las", "isprs/samp53.las", "forest/bcts_1.las", "formats/Example.las"}) {
    SCOPED_TRACE(name);
    REQUIRE_FILE(at(name));
    const auto file = open_points(at(name));
    ASSERT_TRUE(file->info().declared_bounds_m);
    const std::array<double, 6> box = *file->info().declared_bounds_m;
    const PointBlock block = read_all(*file);
    EXPECT_EQ(block.dropped(), 0u);
    std::array<double, 6> found = {1e300, 1e300, 1e300, -1e300, -1e300, -1e300};
    for (std::size_t i = 0; i < block.size(); ++i) {
      const double p[] = {static_cast<double>(block.x_mm[i]) / 1000, static_cast<double>(block.y_mm[i]) / 1000,
                          static_cast<double>(block.z_mm[i]) / 1000};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        found[axis] = std::min(found[axis], p[axis]);
        found[3 + axis] = std::max(found[3 + axis], p[axis]);
      }
    }
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(found[i], box[i], 0.011) << i;
  }
}

TEST_F(RealData, LasCopyDiffersInTheClassOnly) {
  REQUIRE_FILE(at("lake/topography.las"));
  const TemporaryFolder folder;
  const auto file = open_points(at("lake/topography.las"));
  const std::vector<Label> labels(file->size(), Label::kTerrain);
  const auto writer = create_labels(*file, folder.path());
  writer->write(0, labels);
  writer->commit();
  Bytes copy = read_bytes(writer->path()), original = read_bytes(file->path());
  ASSERT_EQ(copy.size(), original.size());
  for (std::size_t i = 0, at_class = 297 + 15; i < labels.size(); ++i, at_class += 28) {
    ASSERT_EQ(copy[at_class], (original[at_class] & 0xE0) | 2);
    copy[at_class] = original[at_class];
  }
  EXPECT_EQ(copy, original);
}

TEST_F(RealData, KittiScansHaveALabelAPoint) {
  REQUIRE_FILE(at("semantickitti/full_scans/velodyne/000000.bin"));
  const auto file = open_points(at("semantickitti/full_scans/velodyne/000000.bin"));
  EXPECT_EQ(file->size(), 124'668u);
  EXPECT_EQ(read_classes(at("semantickitti/full_scans/labels/000000.label")).size(), file->size());
  EXPECT_EQ(read_all(*file).dropped(), 0u);
}

TEST_F(RealData, PcdFiles) {
  REQUIRE_FILE(at("robot/hku_campus_5cm.pcd"));
  const auto file = open_points(at("robot/hku_campus_5cm.pcd"));
  EXPECT_EQ(file->size(), 2'423'802u);
  EXPECT_EQ(read_all(*file).dropped(), 0u);
  const auto example = open_points(at("formats/Example.pcd"));
  EXPECT_TRUE(example->info().warnings.empty()) << "numbers in text lose nothing, whatever SIZE says";
  EXPECT_EQ(read_all(*example).y_mm[0], 5'248'000'500);
}

}  // namespace
}  // namespace btms::test
