// Label heights and standard deviations of the coarse-to-fine method.
#include "engine/terrain/level_accuracy.h"

#include <gtest/gtest.h>

#include <memory>

#include "engine/metrics/surface_scores.h"
#include "engine/model/memory_map.h"
#include "engine/model/surface.h"
#include "engine/scenes/scene.h"
#include "engine/terrain/parameters.h"
#include "engine/terrain/scatter.h"
#include "engine/tiling/build.h"
#include "tests/support/cloud.h"

namespace btms::test {
namespace {

const LevelParameters kCity = preset("city");

TEST(GroundScatter, CountsPointsBelowTheSurfaceOnly) {
  GroundScatter s;
  for (int i = 0; i < 10'000; ++i) {
    s.add_below(100);
    s.add_below(-700);  // a shrub
    s.add_below(0);
    s.add_below(30'000);  // noise
  }
  EXPECT_EQ(s.count, 10'000);
  EXPECT_NEAR(s.rms_mm(), 100, 0.1);
  GroundScatter twice = s;
  twice += s;
  EXPECT_EQ(twice.count, 20'000);
  EXPECT_NEAR(twice.rms_mm(), 100, 0.1);
}

TEST(GroundScatter, FewPointsHardlyMoveIt) {
  GroundScatter s;
  EXPECT_EQ(s.rms_mm(), 45) << "no point: what surveys usually have, not 0";
  s.add_below(500);
  EXPECT_LT(s.rms_mm(), 200);
}

TEST(LevelAccuracy, LabelHeightFollowsThePlace) {
  const PriorPlane flat{0, 0, 0, 20}, steep{0, 0.5, 0, 20};
  const double street = terrain_height_mm(flat, 5, 10, kCity);
  EXPECT_NEAR(street, 2.5 * 45 + 0.8 * 5 + 0.7 * 20, 1e-9) << "a good survey is no reason to cut kerbs off";
  EXPECT_GT(terrain_height_mm(flat, 5, 100, kCity), street + 100) << "rough ground";
  EXPECT_GT(terrain_height_mm(flat, 100, 10, kCity), street + 50) << "planes that disagree";
  EXPECT_NEAR(terrain_height_mm(steep, 100, 10, kCity) - terrain_height_mm(flat, 100, 10, kCity), 4 * 0.5 * 100, 1e-9);
  const PriorPlane cliff{0, 50, 0, 20};
  EXPECT_LT(terrain_height_mm(cliff, 100, 10, kCity), 1500) << "slopes count up to a limit";
}

TEST(LevelAccuracy, DeviationOfSeenHeights) {
  EXPECT_NEAR(observed_sd_mm(20, 60, kCity), 39, 1e-9);
  EXPECT_NEAR(observed_sd_mm(20, 20, kCity), 19.5, 1e-9) << "smooth ground: half of it is the survey's noise";
  EXPECT_NEAR(observed_sd_mm(0, 50, kCity), 10, 1e-9) << "planes that agree by chance";
}

TEST(LevelAccuracy, DeviationOfInferredHeights) {
  const PriorPlane near{0, 0, 0, 10};
  EXPECT_NEAR(inferred_sd_mm(near, 0, 40, kCity), 38, 1e-9);
  EXPECT_NEAR(inferred_sd_mm(near, 300.0 * 300, 40, kCity), std::sqrt(38.0 * 38 + 300 * 300), 1e-9);
  EXPECT_GT(inferred_sd_mm({0, 0, 0, 0}, 0, 40, kCity), 0) << "a single neighbour is not certainty";
}

// The promise as a whole, on worlds with exact truth.
TEST(LevelAccuracy, TheTruthLiesInTheIntervalNineteenTimesInTwenty) {
  for (const char* name : {"city", "bumpy", "forest"}) {
    SceneOptions options;
    options.name = name;
    options.points = 400'000;
    const auto scene = Scene::create(options);
    std::vector<ScenePoint> seen;
    for (std::size_t b = 0; b < scene->blocks(); ++b) scene->generate(b, seen);
    std::vector<CloudPoint> points;
    for (const ScenePoint& p : seen) points.push_back({p.x_mm, p.y_mm, p.z_mm});
    const CloudSource source(points);
    const PointSource* sources[] = {&source};
    BuildOptions build;
    build.parameters = preset("city");
    MemoryMap map;
    Progress progress;
    build_map(
        sources, build, *serial_threads(), *single_rank(),
        [&](const MapLayout& layout) -> TileSink& { return map = MemoryMap(layout); }, progress);
    std::vector<SurfaceSample> open, hidden;
    for (double x = 2.3; x < scene->width_m() - 2; x += 1.7)
      for (double y = 2.1; y < scene->height_m() - 2; y += 1.7) {
        const PlaceTruth truth = scene->truth(x, y);
        const SurfacePoint at = surface_at(map, x, y);
        if (truth.at_step || truth.upper_z_m) continue;
        (truth.stratum == Stratum::kOpen ? open : hidden)
            .push_back(surface_sample(at.state, at.z_m, at.sd_m, truth.ground_z_m, 0, false));
      }
    EXPECT_GT(score_surface(open).within, 0.92) << name;
    EXPECT_LT(score_surface(open).within, 0.985) << name;
    EXPECT_GT(score_surface(hidden).within, 0.92) << name;
    EXPECT_LT(score_surface(hidden).within, 0.985) << name;
  }
}

}  // namespace
}  // namespace btms::test
