// A scan's fast way against the way of maps: labels and counts bit for bit.
#include "engine/tiling/scan_segmenter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "engine/error.h"
#include "engine/tiling/segment.h"
#include "tests/support/cloud.h"

namespace btms::test {
namespace {

void expect_as_map(ScanSegmenter& segmenter, const std::vector<CloudPoint>& points, const Parameters& p) {
  const CloudSource source(points);
  const SegmentedScan truth = segment_scan(source, p);
  const std::span<const Label> labels = segmenter.segment(source);
  ASSERT_TRUE(std::equal(labels.begin(), labels.end(), truth.labels.begin(), truth.labels.end()));
  const LabelCounts &a = segmenter.counts(), &b = truth.counts;
  EXPECT_EQ(a.terrain, b.terrain);
  EXPECT_EQ(a.obstacle, b.obstacle);
  EXPECT_EQ(a.below, b.below);
  EXPECT_EQ(a.dropped, b.dropped);
  EXPECT_EQ(a.outside, b.outside);
}

TEST(ScanSegmenter, GivesTheLabelsOfAMap) {
  for (const char* name : {"paper-single-scan", "paper-partial-map"})
    for (const double resolution : {0.8, 2.0, 4.0})
      for (const NodeModel model : {NodeModel::kPca, NodeModel::kRobust})
        for (const CompletionNormals normals : {CompletionNormals::kFaithful, CompletionNormals::kPlane}) {
          Parameters p = preset(name);
          p.resolution_m = resolution;
          if (resolution < 1) p.min_points = 3;
          p.node_model = model;
          p.completion_normals = normals;
          ScanSegmenter segmenter(p);
          // One object for scans of all sizes and places.
          expect_as_map(segmenter, hard_scene(0, 0, 40'000, 30'000), p);
          EXPECT_GT(segmenter.counts().terrain, 1000u);
          EXPECT_GT(segmenter.counts().obstacle, 100u);
          expect_as_map(segmenter, {{5, 5, 5}}, p);
          expect_as_map(segmenter, hard_scene(-31'000, 691'000'000, 17'000, 25'000), p);
          expect_as_map(segmenter, {}, p);
          expect_as_map(segmenter, hard_scene(-20'000, -15'000, 40'000, 30'000), p);
        }
}

TEST(ScanSegmenter, StraysTakeTheWayOfMaps) {
  const Parameters p = preset("paper-single-scan");
  std::vector<CloudPoint> points = hard_scene(0, 0, 30'000, 20'000);
  points.push_back({9'000'000, -9'000'000, 0});
  points.push_back({INT64_C(-9'000'000'000), 0, 0});
  ScanSegmenter segmenter(p);
  expect_as_map(segmenter, points, p);
}

// Only the squares that labels depend on are worked on, level by level and round by round: one ring too few shows.
TEST(ScanSegmenter, CoarseToFineGivesTheLabelsOfAMap) {
  for (const int rounds : {1, 3})
    for (const double resolution : {0.2, 1.0}) {
      Parameters p = preset("single-scan");
      p.resolution_m = resolution;
      p.level_rounds = rounds;
      ScanSegmenter segmenter(p);
      expect_as_map(segmenter, hard_scene(0, 0, 60'000, 6'000), p);
      EXPECT_GT(segmenter.counts().terrain, 500u);
      EXPECT_GT(segmenter.counts().obstacle, 100u);
      expect_as_map(segmenter, {{5, 5, 5}}, p);
      expect_as_map(segmenter, {}, p);
      // Rings of a scanner: squares without points in between.
      std::vector<CloudPoint> rings;
      for (const CloudPoint& point : hard_scene(-31'000, 691'000'000, 40'000, 40'000))
        if (point.x_mm / 3000 % 3 == 0) rings.push_back(point);
      expect_as_map(segmenter, rings, p);
      rings.push_back({90'000'000, 691'000'000, 0});  // too far off for a map of one tile
      expect_as_map(segmenter, rings, p);
    }
}

TEST(ScanSegmenter, DroppedPointsKeepTheirPlace) {
  const Parameters p = preset("paper-partial-map");
  std::vector<CloudPoint> points = hard_scene(-500'000, 0, 20'000, 20'000);
  for (std::size_t i = 0; i < points.size(); i += 97) points[i].x_mm = PointBlock::kDroppedX;
  ScanSegmenter segmenter(p);
  expect_as_map(segmenter, points, p);
  EXPECT_EQ(segmenter.counts().dropped, (points.size() + 96) / 97);
  for (CloudPoint& point : points) point.x_mm = PointBlock::kDroppedX;
  try {
    segmenter.segment(CloudSource(points));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kBadInput);
  }
  expect_as_map(segmenter, hard_scene(0, 0, 20'000, 20'000), p);
}

TEST(ScanSegmenter, RefusesParametersOutOfRange) {
  Parameters p;
  p.resolution_m = -1;
  EXPECT_THROW(ScanSegmenter{p}, Error);
}

TEST(ScanSegmenter, ReadsFloatsInAnyLayout) {
  const Parameters p = preset("paper-partial-map");
  Random random(17);
  std::vector<float> x, y, z;
  std::vector<CloudPoint> points;
  for (const CloudPoint& c : hard_scene(-9'000, -7'000, 20'000, 15'000)) {
    x.push_back(static_cast<float>(c.x_mm) / 1000 + static_cast<float>(random.between(-500, 500)) * 1e-6f);
    y.push_back(static_cast<float>(c.y_mm) / 1000);
    z.push_back(static_cast<float>(c.z_mm) / 1000 + 0.0005f);  // ties and near ties
  }
  x[3] = std::numeric_limits<float>::quiet_NaN();
  y[4] = std::numeric_limits<float>::infinity();
  z[5] = 1e20f;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const bool dropped = i >= 3 && i <= 5;
    points.push_back({dropped ? PointBlock::kDroppedX : static_cast<std::int64_t>(std::nearbyint(x[i] * 1000.0)),
                      dropped ? 0 : static_cast<std::int64_t>(std::nearbyint(y[i] * 1000.0)),
                      dropped ? 0 : static_cast<std::int32_t>(std::nearbyint(z[i] * 1000.0))});
  }
  ScanSegmenter reference(p), segmenter(p);
  const std::span<const Label> expected = reference.segment(CloudSource(points));
  EXPECT_EQ(reference.counts().dropped, 3u);
  const auto same = [&](const ScanPoints& scan) {
    const std::span<const Label> labels = segmenter.segment(scan);
    return std::equal(labels.begin(), labels.end(), expected.begin(), expected.end());
  };
  EXPECT_TRUE(same({x.data(), y.data(), z.data(), x.size()}));
  std::vector<float> rows;
  std::vector<char> packed;  // 15 bytes a point: floats that are not aligned
  for (std::size_t i = 0; i < x.size(); ++i) {
    const float point[] = {x[i], y[i], z[i], 0.5f};
    rows.insert(rows.end(), point, point + 4);
    packed.resize(packed.size() + 15);
    std::memcpy(packed.data() + 15 * i, point, 12);
  }
  EXPECT_TRUE(same(interleaved(rows.data(), x.size(), 4)));
  const auto at = [&](std::size_t byte) { return reinterpret_cast<const float*>(packed.data() + byte); };
  EXPECT_TRUE(same({at(0), at(4), at(8), x.size(), 15}));
  EXPECT_TRUE(segmenter.segment(ScanPoints{}).empty());
}

TEST(ScanSegmenter, RealScans) {
  const char* data = std::getenv("BTMS_DATA");
  if (data == nullptr) GTEST_SKIP() << "BTMS_DATA is not set";
  const auto folder = std::filesystem::path(data) / "semantickitti" / "full_scans" / "velodyne";
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "no scans";
  for (const char* name : {"paper-single-scan", "single-scan"}) {
    const Parameters p = preset(name);
    ScanSegmenter segmenter(p);
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      std::vector<float> floats(entry.file_size() / sizeof(float));
      std::ifstream(entry.path(), std::ios::binary)
          .read(reinterpret_cast<char*>(floats.data()), static_cast<std::streamsize>(entry.file_size()));
      std::vector<CloudPoint> points;
      for (std::size_t i = 0; i < floats.size(); i += 4)
        points.push_back({static_cast<std::int64_t>(std::nearbyint(floats[i] * 1000.0)),
                          static_cast<std::int64_t>(std::nearbyint(floats[i + 1] * 1000.0)),
                          static_cast<std::int32_t>(std::nearbyint(floats[i + 2] * 1000.0))});
      const SegmentedScan truth = segment_scan(CloudSource(points), p);
      const std::span<const Label> labels = segmenter.segment(interleaved(floats.data(), floats.size() / 4, 4));
      ASSERT_TRUE(std::equal(labels.begin(), labels.end(), truth.labels.begin(), truth.labels.end())) << entry.path();
    }
  }
}

}  // namespace
}  // namespace btms::test
