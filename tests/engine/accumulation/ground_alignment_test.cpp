#include "engine/accumulation/ground_alignment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/error.h"

namespace btms {
namespace {

double ground_m(double x, double y) { return 0.3 * std::sin(x / 15) + 0.02 * y + 0.1 * std::cos(y / 9); }

// Along x a metre a scan, 1.7 m above the ground, level.
std::vector<Pose> level_poses(std::size_t n) {
  std::vector<Pose> poses(n);
  for (std::size_t i = 0; i < n; ++i) poses[i].place_m = {static_cast<double>(i), 0.2, 1.7};
  return poses;
}

// What scans made at these poses see of the ground, with noise and some things that are no ground.
std::vector<std::vector<GroundPatch>> see_ground(const std::vector<Pose>& poses, double outliers, double reach_m = 15) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.01);
  std::uniform_real_distribution<double> place(-reach_m, reach_m), chance(0, 1);
  std::vector<std::vector<GroundPatch>> ground(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i)
    for (int k = 0; k < 1500; ++k) {
      const double x = poses[i].place_m[0] + place(random), y = poses[i].place_m[1] + place(random);
      const double z = ground_m(x, y) + noise(random) + (chance(random) < outliers ? 0.5 : 0);
      const auto p = poses[i].inverse().to_map({x, y, z});
      ground[i].push_back({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
    }
  return ground;
}

// Turned about the y axis by `pitch`, raised by `height_m`.
Pose strayed(const Pose& pose, double pitch, double height_m) {
  Pose turn;
  turn.rotation = {std::cos(pitch), 0, std::sin(pitch), 0, 1, 0, -std::sin(pitch), 0, std::cos(pitch)};
  Pose out = pose;
  out.rotation = turn.after(pose).rotation;
  out.place_m[2] += height_m;
  return out;
}

AlignedPoses align(std::span<const std::vector<GroundPatch>> ground, std::span<const Pose> poses) {
  Progress unwatched;
  return align_ground(ground, poses, unwatched);
}

double largest_height_error_m(const std::vector<Pose>& found, const std::vector<Pose>& truth) {
  double most = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    most = std::max(most, std::abs(found[i].place_m[2] - truth[i].place_m[2]));
  return most;
}

TEST(GroundAlignment, TakesOutDriftOfHeightAndPitch) {
  const auto truth = level_poses(40);
  const auto ground = see_ground(truth, 0.1);
  std::vector<Pose> drifting;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const auto t = static_cast<double>(i);
    drifting.push_back(strayed(truth[i], 0.0006 * t, 0.015 * t));
  }
  const AlignedPoses aligned = align(ground, drifting);
  EXPECT_GT(largest_height_error_m(drifting, truth), 0.5);
  EXPECT_LT(largest_height_error_m(aligned.poses, truth), 0.03);
  EXPECT_NEAR(aligned.largest_m, 0.585, 0.03);
  EXPECT_NEAR(aligned.largest_slope, 0.0234, 0.0017);
}

TEST(GroundAlignment, SmearIsTheRangeOfWhatScansSaw) {
  std::vector<Pose> poses = level_poses(12);
  const auto ground = see_ground(poses, 0);
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i].place_m[2] += i % 2 == 0 ? 0 : 0.2;
  const AlignedPoses aligned = align(ground, poses);
  EXPECT_NEAR(aligned.smear_before_m, 0.17, 0.04);  // planes of squares that few scans saw take some of the 0.2
  EXPECT_LT(aligned.smear_after_m, 0.05);           // noise of a centimetre
}

TEST(GroundAlignment, ClosesALoopThatIsMetresOff) {
  std::vector<Pose> truth = level_poses(30), back = level_poses(30);
  truth.insert(truth.end(), back.rbegin(), back.rend());
  const auto ground = see_ground(truth, 0.1);
  std::vector<Pose> drifting;
  for (std::size_t i = 0; i < truth.size(); ++i)
    drifting.push_back(strayed(truth[i], 0, 0.04 * static_cast<double>(i)));
  EXPECT_LT(largest_height_error_m(align(ground, drifting).poses, truth), 0.03);
}

TEST(GroundAlignment, LeavesGoodPosesAlone) {
  const auto truth = level_poses(60);
  const AlignedPoses aligned = align(see_ground(truth, 0.1), truth);
  EXPECT_LT(aligned.largest_m, 0.01);
  EXPECT_LT(aligned.largest_slope, 0.0009);
}

TEST(GroundAlignment, KeepsPosesOfScansThatShareNothing) {
  std::vector<Pose> apart(3);
  for (std::size_t i = 0; i < 3; ++i) apart[i].place_m = {1000.0 * static_cast<double>(i), 0, static_cast<double>(i)};
  const AlignedPoses aligned = align(see_ground(apart, 0), apart);
  EXPECT_EQ(largest_height_error_m(aligned.poses, apart), 0);
  EXPECT_EQ(align({}, {}).poses.size(), 0u);
  const std::vector<std::vector<GroundPatch>> nothing(3);
  EXPECT_EQ(align(nothing, apart).largest_m, 0);
}

// A vehicle at a red light: squares take some of its scans only, and each scan has squares enough.
TEST(GroundAlignment, CorrectsAllOfManyScansOfOnePlace) {
  std::vector<Pose> truth = level_poses(160);
  for (std::size_t i = 10; i < truth.size(); ++i) truth[i].place_m[0] = std::max(10.0, truth[i].place_m[0] - 140);
  const auto ground = see_ground(truth, 0.1, 3);
  std::vector<Pose> drifting;
  for (std::size_t i = 0; i < truth.size(); ++i)
    drifting.push_back(strayed(truth[i], 0, 0.05 * static_cast<double>(i % 7)));
  EXPECT_LT(largest_height_error_m(align(ground, drifting).poses, truth), 0.03);
}

TEST(GroundAlignment, IsStoppedBetweenSolves) {
  struct Stopping final : Progress {
    void begin(std::string_view, std::uint64_t total, std::string_view) override { solves = total; }
    void advance(std::uint64_t n) override { done += n; }
    bool stop_requested() const override { return done == 3; }
    std::uint64_t solves = 0, done = 0;
  } progress;
  const auto poses = level_poses(5);
  EXPECT_THROW(align_ground(see_ground(poses, 0), poses, progress), Error);
  EXPECT_EQ(progress.done, 3u);
  EXPECT_GT(progress.solves, 3u);
}

TEST(GroundAlignment, PatchesAreBareGroundWithinReach) {
  PointBlock points;
  points.reset(6);
  points.x_mm = {5100, 5300, 30000, -5100, -5200, 7100};
  points.y_mm = {100, 200, 0, 100, 200, 100};
  points.z_mm = {-1700, -1720, -1700, -1700, -1300, -1700};
  const Label labels[] = {Label::kTerrain, Label::kTerrain, Label::kTerrain,
                          Label::kTerrain, Label::kTerrain, Label::kObstacle};
  const auto patches = ground_patches(points, labels);
  ASSERT_EQ(patches.size(), 1u);  // too far, too rough, no terrain
  EXPECT_FLOAT_EQ(patches[0].x_m, 5.2f);
  EXPECT_FLOAT_EQ(patches[0].y_m, 0.15f);
  EXPECT_FLOAT_EQ(patches[0].z_m, -1.71f);
}

}  // namespace
}  // namespace btms
