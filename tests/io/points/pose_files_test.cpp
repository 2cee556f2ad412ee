#include "io/points/pose_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "engine/error.h"
#include "io/points/pose_text.h"

namespace btms {
namespace {

class PoseFiles : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) const {
    const auto path = std::filesystem::path(testing::TempDir()) /
                      (std::string("poses_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }
  std::string refusal(const std::string& text) const {
    try {
      read_poses(write(text));
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kBadInput);
      return error.what();
    }
    return "accepted";
  }
};

TEST_F(PoseFiles, WhatWasWrittenIsReadAgain) {
  const double c = 0.8, s = 0.6;
  const std::vector<Pose> poses{{{c, -s, 0, s, c, 0, 0, 0, 1}, {500'000.125, -3, 0.1}},
                                {{1, 0, 0, 0, c, -s, 0, s, c}, {1, 2, 3}}};
  for (const std::string& text : {kitti_poses(poses), tum_poses(poses, 0.1)}) {
    const auto read = read_poses(write(text));
    ASSERT_EQ(read.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i)
      for (std::size_t k = 0; k < 9; ++k) {
        EXPECT_NEAR(read[i].rotation[k], poses[i].rotation[k], 1e-12);
        EXPECT_EQ(read[i].place_m[k % 3], poses[i].place_m[k % 3]);
      }
  }
}

TEST_F(PoseFiles, RefusesWhatIsNoPose) {
  using testing::HasSubstr;
  EXPECT_THAT(refusal("1 0 0 0 0 1 0 0 0 0 1 0\n2 0 0 0 0 2 0 0 0 0 2 0\n"), HasSubstr("line 2: found no rotation"));
  EXPECT_THAT(refusal("1 0 0 0 0 1 0 0 0 0 -1 0\n"), HasSubstr("right-handed"));  // a mirror
  EXPECT_THAT(refusal("1 2 3\n"), HasSubstr("found 3 numbers, expected 12"));
  EXPECT_THAT(refusal("0 1 2 3 0 0 0 0\n"), HasSubstr("no rotation"));  // a quaternion of length 0
  EXPECT_THAT(refusal("1 0 0 nan 0 1 0 0 0 0 1 0\n"), HasSubstr("not finite"));
  EXPECT_THAT(refusal("1 0 0 1e12 0 1 0 0 0 0 1 0\n"), HasSubstr("too far out"));
  EXPECT_THAT(refusal("nan 0 0 0 0 1 0 0 0 0 1 0\n"), HasSubstr("no rotation"));
  EXPECT_THAT(refusal("one 0 0 0 0 1 0 0 0 0 1 0\n"), HasSubstr("no number"));
  EXPECT_THAT(refusal("# nothing\n"), HasSubstr("no pose in it"));
}

TEST_F(PoseFiles, CalibrationIsTheLineTr) {
  const auto path = write("P0: 1 2 3\nTr: 0 -1 0 0.5 0 0 -1 0 1 0 0 2\n");
  EXPECT_EQ(read_calibration(path).place_m, (std::array<double, 3>{0.5, 0, 2}));
  EXPECT_THROW(read_calibration(write("P0: 1 2 3\n")), Error);
  EXPECT_THROW(read_calibration(write("Tr: 1 2 3\n")), Error);
  EXPECT_THROW(read_calibration(write("Tr: 1 0 0 0 0 1 0 0 0 0 1 0 rubbish\n")), Error);
  EXPECT_THROW(read_calibration(write("Tr: 1 0 0 0 0 1 0 0 0 0 1 0, 7\n")), Error);
  EXPECT_THROW(read_calibration(write("Tr: 2 0 0 0 0 1 0 0 0 0 1 0\n")), Error);
}

TEST_F(PoseFiles, QuaternionsHaveAnyLength) {
  const auto poses = read_poses(write("0 1 2 3 0 0 1 1\n0 1 2 3 0 0 1e200 1e200\n0 1 2 3 0 0 1e-200 1e-200\n"));
  ASSERT_EQ(poses.size(), 3u);
  for (const Pose& pose : poses) EXPECT_NEAR(pose.rotation[3], 1, 1e-12);
  EXPECT_THAT(refusal("0 1 2 3 0 0 inf 1\n"), testing::HasSubstr("no rotation"));
  EXPECT_THAT(refusal("0 1 2 3 0 0 nan 1\n"), testing::HasSubstr("no rotation"));
}

TEST_F(PoseFiles, InverseTakesBack) {
  const Pose pose = read_poses(write("3 1 2 3 0.1 -0.2 0.3 0.9\n"))[0];
  const Pose same = pose.inverse().after(pose);
  for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(same.rotation[k], k % 4 == 0 ? 1 : 0, 1e-12);
  for (const double m : same.place_m) EXPECT_NEAR(m, 0, 1e-12);
}

}  // namespace
}  // namespace btms
