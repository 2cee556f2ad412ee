// What --trajectory does, and what is said of it.
#include <gmock/gmock.h>

#include "tests/cli/program.h"

namespace btms::test {
namespace {

// A floor that is kept only where the sensor passed over it: no component has so many nodes.
class CliTrajectory : public testing::Test {
 protected:
  CliTrajectory() { write_scan(folder_ / "scan.bin", floor_and_wall()); }
  std::vector<std::string> build(const std::string& poses, const std::string& keep_nodes = "1000000") const {
    write_text(folder_ / "poses.txt", poses);
    std::vector<std::string> call{
        "build",    folder_ / "scan.bin", "-o", folder_ / "map.btms", "--preset", "paper-partial-map", "--keep-nodes",
        keep_nodes, "--min-points",       "3",  "--progress",         "none"};
    if (!poses.empty()) call.insert(call.end(), {"--trajectory", folder_ / "poses.txt"});
    return call;
  }
  const TempFolder folder_;
};

TEST_F(CliTrajectory, KeepsWhatItPassedOverAndIsRecorded) {
  const auto without = run_json(build(""));
  EXPECT_EQ(without["nodes"]["observed"], 0);
  EXPECT_TRUE(without["trajectory"].is_null());
  EXPECT_TRUE(run_json({"info", folder_ / "map.btms"})["trajectory"].is_null());

  const auto with = run_json(build("-2 1 0\n-2 2 0\n"));
  EXPECT_NE(with["digest"], without["digest"]);
  EXPECT_GT(with["nodes"]["observed"], 100);
  EXPECT_EQ(with["warnings"], nlohmann::json::array());
  const nlohmann::json record{{"name", "poses.txt"}, {"poses", 2}, {"bytes", 14}};
  EXPECT_EQ(with["trajectory"], record);
  EXPECT_EQ(run_json({"info", folder_ / "map.btms"})["trajectory"], record);
  EXPECT_THAT(run({"info", folder_ / "map.btms"}).out, testing::HasSubstr("poses.txt, 2 poses"));
  EXPECT_THAT(run(build("-2 1 0\n-2 2 0\n")).out, testing::HasSubstr("poses.txt, 2 poses"));
}

TEST_F(CliTrajectory, OneThatPassesElsewhereIsWarnedOf) {
  for (const char* poses : {"5000 5000 0\n", "-2 1 40\n", "-2 1 -2.5\n-2 1 1.9\n"}) {
    auto call = build(poses, "1");
    call.emplace_back("--json");
    const Outcome outcome = run(call);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_THAT(outcome.json()["warnings"].dump(), testing::HasSubstr("the trajectory changes nothing")) << poses;
    EXPECT_THAT(outcome.err, testing::HasSubstr("the trajectory changes nothing")) << poses;
  }
}

TEST_F(CliTrajectory, IsNoPlaceForAPicture) {
  auto call = build("-2 1 0\n");
  fs::rename(folder_ / "poses.txt", folder_ / "poses.png");
  call.back() = folder_ / "poses.png";
  call.insert(call.end(), {"--picture", folder_ / "poses.png"});
  const Outcome outcome = run(call);
  EXPECT_EQ(outcome.status, 2) << outcome.err;
  EXPECT_EQ(read_text(folder_ / "poses.png"), "-2 1 0\n");
  EXPECT_FALSE(fs::exists(folder_ / "map.btms"));
}

}  // namespace
}  // namespace btms::test
