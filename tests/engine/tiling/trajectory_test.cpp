// What the sensor passed over is terrain.
#include "engine/tiling/trajectory.h"

#include <gtest/gtest.h>

#include "engine/model/memory_map.h"
#include "engine/model/surface.h"
#include "engine/tiling/build.h"
#include "tests/support/cloud.h"

namespace btms::test {
namespace {

// A plain of 256 m with a platform of 40 m, 6 m above it, sheer on all sides: a flat roof, or a place on top of a hill.
std::vector<CloudPoint> platform() {
  std::vector<CloudPoint> points;
  Random random(3);
  for (int i = 0; i < 400'000; ++i) {
    const std::int64_t x = random.between(0, 256'000 - 1), y = random.between(0, 256'000 - 1);
    const bool on = x > 108'000 && x < 148'000 && y > 108'000 && y < 148'000;
    points.push_back(
        {x, y, static_cast<std::int32_t>((on ? 6000 : 0) + static_cast<std::int64_t>(random.between(0, 40 - 1)))});
  }
  return points;
}

double height_on_top(const Parameters& parameters, const std::vector<TrajectoryPoint>& trajectory,
                     std::int32_t tile_cells) {
  const CloudSource source(platform());
  const PointSource* sources[] = {&source};
  BuildOptions options;
  options.parameters = parameters;
  options.trajectory = trajectory;
  options.tile_cells = tile_cells;
  MemoryMap map;
  Progress progress;
  build_map(
      sources, options, *serial_threads(), *single_rank(),
      [&](const MapLayout& layout) -> TileSink& { return map = MemoryMap(layout); }, progress);
  const SurfacePoint top = surface_at(map, 128, 128);
  return top.state == NodeState::kUnknown ? -99 : top.z_m;
}

TEST(Trajectory, KeepsWhatTheSensorPassedOver) {
  const Parameters city = preset("city");
  for (const std::int32_t tile_cells : {0, 1}) {
    EXPECT_NEAR(height_on_top(city, {}, tile_cells), 0, 1) << "a roof";
    EXPECT_NEAR(height_on_top(city, {{120'000, 130'000, 7700}, {135'000, 130'000, 7700}}, tile_cells), 6, 0.1);
    EXPECT_NEAR(height_on_top(city, {{120'000, 130'000, 30'000}}, tile_cells), 0, 1) << "flown over";
    EXPECT_NEAR(height_on_top(city, {{20'000, 20'000, 1700}}, tile_cells), 0, 1) << "passed elsewhere";
  }
}

TEST(Trajectory, KeepsSmallComponentsOfTheFixedMethod) {
  Parameters p = preset("paper-partial-map");
  p.keep_nodes = 1'000'000;
  p.min_points = 3;
  const std::vector<TrajectoryPoint> on_top{{120'000, 130'000, 7700}};
  EXPECT_EQ(height_on_top(p, {}, 0), -99) << "nothing is kept";
  EXPECT_NEAR(height_on_top(p, on_top, 0), 6, 0.1);
  EXPECT_NEAR(height_on_top(p, on_top, 8), 6, 0.1);
}

}  // namespace
}  // namespace btms::test
