// btms accumulate: partial maps, and the drift of the ground taken out.
#include <gmock/gmock.h>

#include <limits>

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
