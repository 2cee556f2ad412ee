#include "io/points/pose_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "io/points/trajectory.h"
#include "tests/io/points/files.h"

namespace btms::test {
namespace {

// Turned about every axis and by half a turn, where a quaternion's w is none.
std::vector<Pose> poses() {
  std::vector<Pose> all;
  const double c = 0.6, s = 0.8;
  for (const auto& r : {std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1},
                        {c, -s, 0, s, c, 0, 0, 0, 1},
                        {1, 0, 0, 0, c, -s, 0, s, c},
                        {c, 0, s, 0, 1, 0, -s, 0, c},
                        {-1, 0, 0, 0, -1, 0, 0, 0, 1},
                        {1, 0, 0, 0, -1, 0, 0, 0, -1},
                        {-1, 0, 0, 0, 1, 0, 0, 0, -1},
                        {-c, s, 0, -s * c, -c * c, s, s * s, c * s, c}})
    all.push_back({r, {350'000.123456789, -5'600'000.1, 1.0 / 3}});
  return all;
}

TEST(PoseText, KittiGivesTheSameNumbersBack) {
  std::istringstream text(kitti_poses(poses()));
  for (const Pose& p : poses())
    for (std::size_t row = 0; row < 3; ++row) {
      double v[4];
      text >> v[0] >> v[1] >> v[2] >> v[3];
      for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(v[k], p.rotation[3 * row + k]);
      EXPECT_EQ(v[3], p.place_m[row]);
    }
  EXPECT_TRUE(text);
}

TEST(PoseText, TumHasTheRotationAsAUnitQuaternion) {
  std::istringstream text(tum_poses(poses(), 0.5));
  double expected_time = 0;
  for (const Pose& p : poses()) {
    double time, place[3], x, y, z, w;
    text >> time >> place[0] >> place[1] >> place[2] >> x >> y >> z >> w;
    EXPECT_EQ(time, expected_time);
    expected_time += 0.5;
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(place[k], p.place_m[k]);
    EXPECT_NEAR(x * x + y * y + z * z + w * w, 1, 1e-12);
    const std::array<double, 9> r{1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
                                  2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                                  2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
    for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(r[k], p.rotation[k], 1e-12) << k;
  }
}

TEST(PoseText, IsReadAsATrajectory) {
  const TemporaryFolder folder;
  for (const std::string& text : {kitti_poses(poses()), tum_poses(poses(), 0.1)}) {
    const auto read = read_trajectory(folder.write("poses.txt", text));
    ASSERT_EQ(read.size(), poses().size());
    EXPECT_EQ(read[3].x_mm, 350'000'123);
    EXPECT_EQ(read[3].y_mm, -5'600'000'100);
    EXPECT_EQ(read[3].z_mm, 333);
  }
}

}  // namespace
}  // namespace btms::test
