// btms accumulate: partial maps, and the drift of the ground taken out.
#include <gmock/gmock.h>

#include <limits>

#include "io/points/pose_files.h"
#include "io/points/pose_text.h"
#include "tests/cli/program.h"

namespace btms::test {
namespace {

class CliAccumulate : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TempFolder>();
    run_json({"synth", "--drive", "--scans", "12", "--beams", "32", "--azimuths", "400", "--drift", "3", "--step", "3",
              "-o", *folder_ / "drive"});
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::string in(const std::string& name) { return *folder_ / ("drive/" + name); }
  static std::vector<std::string> call(const std::string& poses, const std::string& output,
                                       const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{"accumulate", "--scans", in("velodyne"), "--labels", in("labels"),
                                   "--poses",    in(poses), "-o",           output};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  static inline std::unique_ptr<TempFolder> folder_;
};

TEST_F(CliAccumulate, MakesTheSameMapWithAnyNumberOfThreads) {
  const TempFolder out;
  const auto one = run_json(call("poses.txt", out / "one.las", {"-j", "1", "--align-ground"}));
  const auto two = run_json(call("poses.txt", out / "two.las", {"-j", "2", "--align-ground"}));
  EXPECT_EQ(one["scans"], 12);
  EXPECT_LT(one["voxels"], one["points"]);
  EXPECT_EQ(one["voxels"].get<int>(), one["terrain"].get<int>() + one["object"].get<int>() +
                                          one["ambiguous"].get<int>() + one["ignored"].get<int>());
  EXPECT_GT(one["terrain"], one["object"]);
  EXPECT_EQ(read_text(out / "one.las"), read_text(out / "two.las"));
}

TEST_F(CliAccumulate, TrueScansLieOnOneGroundDriftingOnesAreBroughtBack) {
  const TempFolder out;
  const auto exact = run_json(call("poses.txt", out / "exact.las", {"--align-ground"}))["alignment"];
  EXPECT_LT(exact["largest_correction_m"], 0.02) << exact;
  const auto drifting = run_json(call("poses_drifting.txt", out / "drifting.las",
                                      {"--align-ground", "--write-poses", out / "aligned.txt"}))["alignment"];
  EXPECT_GT(drifting["largest_tilt_deg"], 0.1) << drifting;
  EXPECT_LT(drifting["smear_after_m"].get<double>(), exact["smear_before_m"].get<double>() + 0.01) << drifting;
  EXPECT_GT(drifting["smear_before_m"].get<double>(), 1.5 * exact["smear_before_m"].get<double>()) << drifting;
  // The poses that were written give this map as they are.
  run_json({"accumulate", "--scans", in("velodyne"), "--labels", in("labels"), "--poses", out / "aligned.txt", "-o",
            out / "again.las"});
  EXPECT_EQ(read_text(out / "again.las"), read_text(out / "drifting.las"));
}

TEST_F(CliAccumulate, TakesScansByTheirNumbers) {
  const TempFolder out;
  const auto some = run_json(call("poses.txt", out / "some.las", {"--first", "3", "--last", "5"}));
  EXPECT_EQ(some["scans"], 3);
  EXPECT_EQ(run(call("poses.txt", out / "none.las", {"--first", "99"})).status, 2);
}

TEST_F(CliAccumulate, AlignsAroundScansWithoutPoints) {
  const TempFolder out;
  fs::create_directories(out / "scans");
  write_text(out / "scans/000000.bin", read_text(in("velodyne/000000.bin")));
  write_text(out / "scans/000001.bin", "");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  write_text(out / "scans/000002.bin",
             std::string(reinterpret_cast<const char*>(std::array{nan, nan, nan, nan}.data()), 16));
  const auto json = run_json(
      {"accumulate", "--scans", out / "scans", "--poses", in("poses.txt"), "--align-ground", "-o", out / "map.las"});
  EXPECT_EQ(json["scans"], 3);
  EXPECT_GT(json["voxels"], 1000);
}

// x right, y down, z forward.
const Pose kToCamera{{0, -1, 0, 0, 0, -1, 1, 0, 0}, {0, 0, 0}};

TEST_F(CliAccumulate, TakesPosesOfACamera) {
  const TempFolder out;
  std::vector<Pose> poses = read_poses(in("poses.txt")), camera;
  const Pose start = poses[0].inverse();  // KITTI's first pose is none at all
  for (Pose& pose : poses) {
    pose = start.after(pose);
    camera.push_back(kToCamera.after(pose).after(kToCamera.inverse()));
  }
  write_text(out / "scanner.txt", kitti_poses(poses));
  write_text(out / "camera.txt", kitti_poses(camera));
  write_text(out / "calib.txt", "P0: 1 2\nTr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n");
  const auto with_poses = [&](const std::string& name, const std::string& map, std::vector<std::string> more) {
    auto words = call("poses.txt", out / map, more);
    words[6] = out / name;
    return words;
  };
  run_json(with_poses("scanner.txt", "scanner.las", {}));
  run_json(with_poses("camera.txt", "camera.las", {"--calib", out / "calib.txt"}));
  EXPECT_EQ(read_text(out / "scanner.las"), read_text(out / "camera.las"));
  const Outcome forgotten = run(with_poses("camera.txt", "wrong.las", {"--align-ground"}));
  EXPECT_THAT(forgotten.err, testing::HasSubstr("give --calib")) << forgotten.out;
  const Outcome right = run(with_poses("camera.txt", "right.las", {"--align-ground", "--calib", out / "calib.txt"}));
  EXPECT_THAT(right.err, testing::Not(testing::HasSubstr("give --calib")));
}

TEST_F(CliAccumulate, TakesPosesOfTum) {
  const TempFolder out;
  const auto kitti = run_json(call("poses.txt", out / "kitti.las"));
  const auto tum = run_json(call("trajectory.txt", out / "tum.las"));
  EXPECT_EQ(kitti["points"], tum["points"]);
  EXPECT_NEAR(kitti["voxels"].get<double>(), tum["voxels"].get<double>(), 20);  // rotations are rounded
}

class ScanNames : public CliAccumulate {
 protected:
  // Scans of these names with a pose each; which of the drive's they are is the number given.
  void put(const std::vector<std::pair<std::string, int>>& names) {
    fs::create_directories(out_ / "scans");
    std::string text;
    std::vector<Pose> poses = read_poses(in("poses.txt"));
    for (std::size_t i = 0; i < names.size(); ++i)
      write_text(out_ / ("scans/" + names[i].first),
                 read_text(in("velodyne/00000" + std::to_string(names[i].second) + ".bin")));
    poses.resize(names.size());
    write_text(out_ / "poses.txt", kitti_poses(poses));
  }
  Outcome accumulate(const std::string& map, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"accumulate",       "--scans", out_ / "scans", "--poses",
                                   out_ / "poses.txt", "-o",      out_ / map};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  }
  std::string plain() const {  // the map of the first three
    EXPECT_EQ(run({"accumulate", "--scans", in("velodyne"), "--poses", in("poses.txt"), "--last", "2", "-o",
                   out_ / "plain.las"})
                  .status,
              0);
    return read_text(out_ / "plain.las");
  }
  const TempFolder out_;
};

TEST_F(ScanNames, OfOneSeriesGoByTheirNumber) {
  put({{"frame_9.bin", 0}, {"frame_10.bin", 1}, {"frame_100.bin", 2}});
  EXPECT_EQ(accumulate("map.las").status, 0);
  EXPECT_EQ(read_text(out_ / "map.las"), plain());
}

TEST_F(ScanNames, MayHaveMoreThanNineDigits) {
  put({{"0000000000.bin", 0}, {"0000000001.bin", 1}, {"0000000002.bin", 2}});
  EXPECT_EQ(accumulate("map.las").status, 0);
  EXPECT_EQ(read_text(out_ / "map.las"), plain());
  fs::remove(out_ / "scans/0000000001.bin");  // the others keep their lines
  EXPECT_EQ(accumulate("gap.las").status, 0);
}

TEST_F(ScanNames, WithoutNumbersGoByTheAlphabet) {
  put({{"a.bin", 0}, {"b.bin", 1}, {"c.bin", 2}});
  EXPECT_EQ(accumulate("map.las").status, 0);
  EXPECT_EQ(read_text(out_ / "map.las"), plain());
  fs::remove(out_ / "scans/b.bin");
  EXPECT_THAT(accumulate("two.las").err, testing::HasSubstr("found 3 poses for 2 scans"));
}

TEST_F(ScanNames, WhoseOrderIsDoubtfulAreRefused) {
  put({{"a_10.bin", 0}, {"b_2.bin", 1}, {"c.bin", 2}});
  const Outcome doubtful = accumulate("map.las");
  EXPECT_EQ(doubtful.status, 2);
  EXPECT_THAT(doubtful.err, testing::HasSubstr("before it by its number"));
  fs::remove_all(out_ / "scans");
  put({{"1.bin", 0}, {"01.bin", 1}});
  EXPECT_THAT(accumulate("map.las").err, testing::HasSubstr("the same number"));
}

TEST_F(CliAccumulate, CountsWhatItLeavesOut) {
  const TempFolder out;
  fs::create_directories(out / "scans");
  auto points = floor_and_wall();
  points[7][0] = std::numeric_limits<float>::quiet_NaN();
  points[8][2] = 9e6f;
  write_scan(out / "scans/000000.bin", points);
  const std::vector<std::string> words{"accumulate",    "--scans", out / "scans",  "--poses",
                                       in("poses.txt"), "-o",      out / "map.las"};
  const auto json = run_json(words);
  EXPECT_EQ(json["dropped"]["not_finite"], 1);
  EXPECT_EQ(json["dropped"]["out_of_range"], 1);
  EXPECT_EQ(json["points"], points.size() - 2);
  fs::remove(out / "map.las");
  EXPECT_THAT(run(words).out, testing::HasSubstr("left out: 1 not finite, 1 out of range"));
}

TEST_F(CliAccumulate, RefusesBeforeTheWork) {
  using testing::HasSubstr;
  const TempFolder out;
  const Outcome nowhere = run(call("poses.txt", out / "map.las", {"--write-poses", out / "no/poses.txt"}));
  EXPECT_EQ(nowhere.status, 1);
  EXPECT_THAT(nowhere.err, HasSubstr("no/poses.txt"));
  const Outcome twice = run(call("poses.txt", out / "map.las", {"--write-poses", out / "./map.las"}));
  EXPECT_EQ(twice.status, 2) << twice.err;
  for (const char* value : {"nan", "-nan", "inf", "0", "x"})
    EXPECT_EQ(run(call("poses.txt", out / "map.las", {"--voxel", value})).status, 2) << value;
  fs::copy(in("labels"), out / "labels", fs::copy_options::recursive);
  fs::resize_file(out / "labels/000007.label", 400);
  auto words = call("poses.txt", out / "map.las", {"--progress", "lines"});
  words[4] = out / "labels";
  const Outcome wrong = run(words);
  EXPECT_EQ(wrong.status, 3);
  EXPECT_THAT(wrong.err, HasSubstr("found 100 labels"));
  EXPECT_EQ(names_in(out.path()), std::vector<std::string>{"labels"});
}

TEST_F(CliAccumulate, RefusesWhatDoesNotFit) {
  using testing::HasSubstr;
  const TempFolder out;
  const std::string poses = read_text(in("poses.txt"));
  write_text(out / "few.txt", poses.substr(0, poses.find('\n', poses.size() / 2) + 1));
  auto words = call("poses.txt", out / "map.las");
  words[6] = out / "few.txt";
  const Outcome few = run(words);
  EXPECT_EQ(few.status, 2);
  EXPECT_THAT(few.err, HasSubstr("there is no pose for it"));
  words = call("poses.txt", out / "map.las");
  words[4] = out / "nowhere";
  EXPECT_EQ(run(words).status, 2);
  EXPECT_EQ(run(call("poses.txt", out / "map.txt")).status, 2);
  EXPECT_EQ(names_in(out.path()), std::vector<std::string>{"few.txt"});
  write_text(out / "map.las", "mine");
  EXPECT_EQ(run(call("poses.txt", out / "map.las")).status, 2);
  EXPECT_EQ(read_text(out / "map.las"), "mine");
}

}  // namespace
}  // namespace btms::test
