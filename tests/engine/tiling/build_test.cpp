// What a build and its labels do with hostile or unusual clouds.
#include "engine/tiling/build.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/error.h"
#include "engine/model/digest.h"
#include "engine/model/surface.h"
#include "engine/tiling/segment.h"
#include "tests/support/cloud.h"

namespace btms::test {
namespace {

SegmentedScan segment(std::vector<CloudPoint> points, const Parameters& p = preset("paper-partial-map")) {
  return segment_scan(CloudSource(std::move(points)), p);
}

// A flat floor of 20 x 20 m, 25 points per m^2.
std::vector<CloudPoint> floor_points() {
  std::vector<CloudPoint> points;
  for (std::int64_t y = 100; y < 20'000; y += 200)
    for (std::int64_t x = 100; x < 20'000; x += 200) points.push_back({x, y, 1000});
  return points;
}

TEST(Build, AFloorIsTerrainAndItsHeightIsKnown) {
  const SegmentedScan s = segment(floor_points());
  EXPECT_EQ(s.counts.terrain, s.labels.size());
  const SurfacePoint p = surface_at(s.map, 10.123, 9.876);
  EXPECT_EQ(p.state, NodeState::kObserved);
  EXPECT_NEAR(p.z_m, 1.0, 1e-9);
  EXPECT_NEAR(p.normal[2], 1.0, 1e-12);
  EXPECT_EQ(surface_at(s.map, 500, 500).state, NodeState::kUnknown);
  EXPECT_EQ(surface_at(s.map, NAN, 0).state, NodeState::kUnknown);
  EXPECT_EQ(surface_at(s.map, 1e300, -INFINITY).state, NodeState::kUnknown);
}

TEST(Build, TheGroundUnderACarIsPredictedAndTheCarIsAnObstacle) {
  std::vector<CloudPoint> points;
  std::size_t car = 0;
  for (const CloudPoint& p : floor_points()) {
    const bool on_car = p.x_mm > 8000 && p.x_mm < 12'000 && p.y_mm > 9000 && p.y_mm < 11'000;
    car += on_car;
    points.push_back({p.x_mm, p.y_mm, on_car ? 2500 : 1000});
  }
  const SegmentedScan s = segment(points);
  EXPECT_EQ(s.counts.obstacle, car);
  const SurfacePoint p = surface_at(s.map, 10, 10);
  EXPECT_EQ(p.state, NodeState::kObstacle);
  EXPECT_NEAR(p.z_m, 1.0, 0.01);
  EXPECT_GT(p.support, 0.05);
}

TEST(Build, NoPointsNoFinitePointsOnePoint) {
  EXPECT_TRUE(segment({}).labels.empty());
  EXPECT_THROW(segment({{PointBlock::kDroppedX, 0, 0}}), Error);
  const SegmentedScan one = segment({{5, 5, 5}});
  ASSERT_EQ(one.labels.size(), 1u);
  EXPECT_EQ(one.labels[0], Label::kObstacle) << "no final plane";
}

TEST(Build, DroppedPointsKeepTheirPlace) {
  std::vector<CloudPoint> points = floor_points();
  points[7].x_mm = points[5000].x_mm = PointBlock::kDroppedX;
  const SegmentedScan s = segment(points);
  ASSERT_EQ(s.labels.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_EQ(s.labels[i], i == 7 || i == 5000 ? Label::kDropped : Label::kTerrain);
  EXPECT_EQ(s.counts.dropped, 2u);
  EXPECT_EQ(s.summary.not_finite, 2u);
}

TEST(Build, PointsFarBelowAreFlagged) {
  std::vector<CloudPoint> points = floor_points();
  points.push_back({10'010, 10'010, -30'000});
  const SegmentedScan s = segment(points);
  EXPECT_EQ(s.labels.back(), Label::kBelow);
  EXPECT_EQ(s.counts.below, 1u);
}

TEST(Build, DuplicatesChangeNothing) {
  std::vector<CloudPoint> points = floor_points();
  const std::vector<CloudPoint> once = points;
  for (int i = 0; i < 3; ++i) points.insert(points.end(), once.begin(), once.end());
  const SegmentedScan a = segment(once), b = segment(points);
  for (double x = 1; x < 19; x += 0.7) EXPECT_EQ(surface_at(a.map, x, 5).z_m, surface_at(b.map, x, 5).z_m);
}

TEST(Build, PointsOnEveryBorderFallInExactlyOneNode) {
  std::vector<CloudPoint> points;
  for (std::int64_t y = -8000; y <= 8000; y += 1000)
    for (std::int64_t x = -8000; x <= 8000; x += 1000) points.push_back({x, y, 0});
  std::uint64_t counted = 0;
  const SegmentedScan s = segment(points);
  for (const TileId id : s.map.tiles())
    for (const NodeSurface& n : s.map.load(id)->nodes) counted += n.count;
  EXPECT_EQ(counted, points.size());
}

TEST(Build, AMapTooLargeIsRefusedBeforeItIsAllocated) {
  std::vector<CloudPoint> points = floor_points();
  points.insert(points.end(), 20, {2'000'000'000, 1'900'000'000, 5});  // too many to be astray
  const CloudSource source(points);
  const PointSource* sources[] = {&source};
  BuildOptions options;
  options.parameters = preset("paper-partial-map");
  options.tile_cells = 0;
  MemoryMap map;
  Progress progress;
  try {
    build_map(
        sources, options, *serial_threads(), *single_rank(), [&](const MapLayout&) -> TileSink& { return map; },
        progress);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kUsage);
    EXPECT_NE(std::string(e.what()).find("--max-nodes"), std::string::npos);
    EXPECT_NE(std::string(e.what()).find("near x = 2000000 m"), std::string::npos) << "names the point: " << e.what();
  }
}

class Stopping final : public Progress {
 public:
  void begin(std::string_view phase, std::uint64_t, std::string_view) override { in_phase_ = phase == phase_; }
  bool stop_requested() const override { return in_phase_; }
  explicit Stopping(std::string phase) : phase_(std::move(phase)) {}

 private:
  std::string phase_;
  bool in_phase_ = false;
};

TEST(Build, StopsInEveryPhase) {
  const CloudSource source(floor_points());
  const PointSource* sources[] = {&source};
  BuildOptions options;
  options.parameters = preset("paper-partial-map");
  for (const char* phase : {"partition", "model", "link", "merge", "complete", "fit"}) {
    MemoryMap map;
    Stopping progress(phase);
    try {
      build_map(
          sources, options, *tbb_threads(2), *single_rank(), [&](const MapLayout&) -> TileSink& { return map; },
          progress);
      FAIL() << phase;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kCancelled);
    }
  }
}

TEST(Digest, SeesEveryStoredField) {
  const SegmentedScan s = segment(hard_scene(0, 0, 30'000, 20'000));
  const TerrainTile tile = *s.map.load(s.map.tiles().front());
  const Digest before = digest(tile);
  std::size_t known = 0;
  for (std::size_t i = 0; i < tile.nodes.size(); ++i)
    if (tile.nodes[i].state == NodeState::kPredicted) known = i;
  ASSERT_GT(known, 0u);
  const auto changed = [&](auto&& change) {
    TerrainTile copy = tile;
    change(copy);
    return !(digest(copy) == before);
  };
  EXPECT_TRUE(changed([&](TerrainTile& t) { t.nodes[known].state = NodeState::kObserved; }));
  EXPECT_TRUE(changed([&](TerrainTile& t) { t.nodes[known].weight ^= 1; }));
  EXPECT_TRUE(changed([&](TerrainTile& t) { t.nodes[known].count ^= 1; }));
  EXPECT_TRUE(changed([&](TerrainTile& t) { t.nodes[known].support ^= 1; }));
  EXPECT_TRUE(changed([&](TerrainTile& t) { t.nodes[known].sd_mm ^= 1; }));
  EXPECT_TRUE(changed([&](TerrainTile& t) { t.resolution_mm += 2; }));
  EXPECT_TRUE(changed([&](TerrainTile& t) { t.box.col0 += 1, t.box.col1 += 1; })) << "moved";
  for (std::size_t i = 0; i < tile.corner_mm.size(); ++i)
    if (tile.corner_mm[i] != kUnknownHeight_mm) {
      EXPECT_TRUE(changed([&](TerrainTile& t) { t.corner_mm[i] ^= 1; })) << "corner " << i;
    }
  for (std::size_t i = 0; i < tile.centre_mm.size(); ++i)
    if (tile.centre_mm[i] != kUnknownHeight_mm) {
      EXPECT_TRUE(changed([&](TerrainTile& t) { t.centre_mm[i] ^= 1; })) << "centre " << i;
    }
}

}  // namespace
}  // namespace btms::test
