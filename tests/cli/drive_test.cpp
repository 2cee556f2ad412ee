// What `synth --drive` writes, and what the other subcommands make of it.
#include <gmock/gmock.h>

#include "tests/cli/program.h"

namespace btms::test {
namespace {

std::vector<std::string> drive(const std::string& folder, const std::vector<std::string>& more = {},
                               const std::string& scans = "4") {
  std::vector<std::string> call{"synth",   "--drive", "--scans",    scans, "--step", "4",
                                "--beams", "16",      "--azimuths", "200", "-o",     folder};
  call.insert(call.end(), more.begin(), more.end());
  return call;
}

std::map<std::string, std::string> files_in(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files[fs::relative(entry.path(), folder).string()] = read_text(entry.path());
  return files;
}

TEST(CliDrive, IsLaidOutAsSemanticKittiWithEqualBytesForAnyThreads) {
  const TempFolder folder;
  const auto json = run_json(drive(folder / "one", {"-j", "1"}));
  run_json(drive(folder / "two", {"-j", "2"}));
  const auto files = files_in(folder / "one");
  EXPECT_EQ(files, files_in(folder / "two"));
  ASSERT_EQ(files.size(), 4u + 4 + 5);
  EXPECT_EQ(json["scans"], 4);
  std::size_t points = 0;
  for (int i = 0; i < 4; ++i) {
    const std::string name = "00000" + std::to_string(i), &scan = files.at("velodyne/" + name + ".bin");
    EXPECT_EQ(scan.size() / 16, files.at("labels/" + name + ".label").size() / 4);
    points += scan.size() / 16;
  }
  EXPECT_EQ(json["points"], points);
  for (const char* name : {"poses.txt", "poses_drifting.txt", "times.txt", "trajectory.txt"})
    EXPECT_EQ(std::count(files.at(name).begin(), files.at(name).end(), '\n'), 4) << name;
  EXPECT_EQ(files.at("calib.txt"), "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n");
  EXPECT_NE(files.at("poses.txt"), files.at("poses_drifting.txt"));
}

TEST(CliDrive, IsSegmentedWell) {
  const TempFolder folder;
  run_json({"synth", "--drive", "-o", folder / "city", "--scans", "4", "--step", "90"});
  run_json({"segment", folder / "city/velodyne", "-o", folder / "predicted"});
  const auto scores = run_json({"eval", "--truth", folder / "city/labels", "--prediction", folder / "predicted"});
  EXPECT_GE(scores["without_ambiguous"]["pooled"]["f1"], 0.97) << scores["without_ambiguous"];
}

TEST(CliDrive, ReplacesNothingUnaskedAndLeavesNothingBehind) {
  const TempFolder folder;
  run_json(drive(folder / "out"));
  const auto before = files_in(folder / "out");
  const Outcome refused = run(drive(folder / "out", {"--seed", "2"}));
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.err, testing::HasSubstr("--force"));
  EXPECT_EQ(files_in(folder / "out"), before);
  const Outcome fewer = run(drive(folder / "out", {"--force"}, "3"));
  EXPECT_EQ(fewer.status, 2) << "a fourth scan would be left";
  EXPECT_THAT(fewer.err, testing::HasSubstr("000003"));
  EXPECT_EQ(files_in(folder / "out"), before);
  run_json(drive(folder / "out", {"--force", "--seed", "2"}));
  EXPECT_EQ(files_in(folder / "out").size(), before.size());
  EXPECT_NE(files_in(folder / "out"), before);
}

TEST(CliDrive, WrongCallsExitWith2) {
  const TempFolder folder;
  for (const std::vector<std::string>& more : {std::vector<std::string>{"--files", "2"},
                                               {"--field-of-view", "-20,2"},
                                               {"--field-of-view", "2"},
                                               {"--points", "500"},
                                               {"--scene", "moon"},
                                               {"--step", "nan"},
                                               {"--field-of-view", "nan,nan"}}) {
    const Outcome outcome = run(drive(folder / "out", more));
    EXPECT_EQ(outcome.status, 2) << testing::PrintToString(more) << outcome.err;
    EXPECT_FALSE(fs::exists(folder / "out")) << testing::PrintToString(more);
  }
  EXPECT_EQ(run(drive(folder / "out", {}, "0")).status, 2);
  EXPECT_EQ(run({"synth", "-o", folder / "out", "--scans", "10"}).status, 2) << "no drive";
}

TEST(CliDrive, SaysWhatTheTruthIs) {
  const TempFolder folder;
  const auto json = run_json(drive(folder / "out", {"--scene", "bumpy", "--seed", "7", "--origin", "1000,-50"}));
  EXPECT_EQ(json["scene_flags"], "--scene bumpy --seed 7 --points 2000000 --origin 1000,-50");
}

}  // namespace
}  // namespace btms::test
