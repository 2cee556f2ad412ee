// A city is worth its name only if the paper's method at one fixed resolution fails on it: it must take roofs for
// ground.
#include <gtest/gtest.h>

#include "engine/scenes/scene.h"
#include "engine/tiling/segment.h"
#include "tests/support/cloud.h"

namespace btms::test {
namespace {

TEST(SceneCity, IsHardForTheMethodAtOneFixedResolution) {
  SceneOptions options;
  options.points = 600'000;
  const auto scene = Scene::create(options);
  std::vector<ScenePoint> points;
  for (std::size_t block = 0; block < scene->blocks(); ++block) scene->generate(block, points);
  std::vector<CloudPoint> cloud;
  for (const ScenePoint& p : points) cloud.push_back({p.x_mm, p.y_mm, p.z_mm});

  Parameters p = preset("paper-partial-map");  // r = 2 m
  ASSERT_EQ(p.resolution_m, 2.0);
  ASSERT_EQ(p.keep_nodes, 10);
  const SegmentedScan result = segment_scan(CloudSource(std::move(cloud)), p);
  std::size_t roof = 0, roof_as_ground = 0, ground = 0, ground_kept = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool terrain = result.labels[i] == Label::kTerrain;
    roof += points[i].label == SceneClass::kBuilding;
    roof_as_ground += points[i].label == SceneClass::kBuilding && terrain;
    ground += points[i].label == SceneClass::kGround;
    ground_kept += points[i].label == SceneClass::kGround && terrain;
  }
  EXPECT_GE(roof_as_ground, roof / 10);
  EXPECT_GE(ground_kept, ground * 8 / 10);  // hard, not absurd
}

}  // namespace
}  // namespace btms::test
