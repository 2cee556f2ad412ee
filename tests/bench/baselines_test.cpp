// The baselines of the paper's table, on a tilted plane with boxes.
#include <gtest/gtest.h>

#include "bench/paper/gpf.h"
#include "bench/paper/ransac.h"

namespace btms::bench {
namespace {

struct World {
  std::vector<Eigen::Vector3f> points;
  std::vector<std::uint8_t> ground;
};

// 40 m x 40 m, rising by 5 cm a metre, with 9 boxes of 1.5 m on it.
World tilted_plane_with_boxes() {
  World world;
  for (int i = 0; i < 200; ++i)
    for (int k = 0; k < 200; ++k) {
      const float x = 0.2f * static_cast<float>(i), y = 0.2f * static_cast<float>(k);
      const bool box = i % 60 > 40 && k % 60 > 40;
      world.points.emplace_back(x, y, 0.05f * x - 1.7f + (box ? 1.5f : 0.0f));
      world.ground.push_back(box ? 0 : 1);
    }
  return world;
}

TEST(Baselines, TellBoxesFromATiltedPlane) {
  const World world = tilted_plane_with_boxes();
  EXPECT_EQ(ransac_ground(world.points), world.ground);
  EXPECT_EQ(gpf_ground(world.points), world.ground);
}

TEST(Gpf, DoesNotStartFromErrorsFarBelowASensorItKnows) {
  World world = tilted_plane_with_boxes();
  for (int i = 0; i < 100; ++i) world.points.emplace_back(0.4f * static_cast<float>(i), 20.0f, -6.0f);
  world.ground.resize(world.points.size(), 0);
  GpfParameters p;
  EXPECT_NE(gpf_ground(world.points, p), world.ground);
  p.sensor_height_m = 1.73;
  EXPECT_EQ(gpf_ground(world.points, p), world.ground);
}

TEST(Baselines, AreTotal) {
  EXPECT_TRUE(ransac_ground({}).empty());
  EXPECT_TRUE(gpf_ground({}).empty());
  const std::vector<Eigen::Vector3f> one(5, Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(ransac_ground(one).size(), 5u);  // no plane through one place
  EXPECT_EQ(gpf_ground(one).size(), 5u);
}

}  // namespace
}  // namespace btms::bench
