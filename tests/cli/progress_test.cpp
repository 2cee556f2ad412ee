// --progress: what is said of a run while it runs.
#include "tests/cli/program.h"

namespace btms::test {
namespace {

std::vector<nlohmann::json> objects_in(const std::string& text) {
  std::vector<nlohmann::json> objects;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    objects.push_back(nlohmann::json::parse(line, nullptr, false));
    EXPECT_FALSE(objects.back().is_discarded()) << line;
  }
  return objects;
}

class BuildProgress : public testing::TestWithParam<std::vector<std::string>> {};

// Every phase is in the plan of the run (apps/btms/run_plan.cpp), and in this order; the plan may have more.
TEST_P(BuildProgress, IsToldOfTheWholeRun) {
  const TempFolder folder;
  run_json({"synth", "--points", "200000", "-o", folder / "world"});
  std::vector<std::string> build = {"build", folder / "world", "-o",   folder / "map", "--preset",
                                    "city",  "--progress",     "json", "--threads",    "2"};
  build.insert(build.end(), GetParam().begin(), GetParam().end());
  const Outcome outcome = run(build);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  int step = 0;
  double share = 0;
  nlohmann::json last;
  for (const auto& line : objects_in(outcome.err)) {
    for (const char* key : {"phase", "step", "steps", "done", "total", "unit", "rate", "seconds", "share",
                            "eta_seconds", "rss_bytes", "finished"})
      ASSERT_TRUE(line.contains(key)) << key << " in " << line;
    EXPECT_GE(line["share"].get<double>(), share) << line;
    EXPECT_GE(line["eta_seconds"].get<double>(), 0) << line;
    EXPECT_GT(line["rss_bytes"].get<double>(), 1e6) << line;
    share = line["share"];
    if (line["finished"] == true) {
      EXPECT_GT(line["step"], step) << line << " is not in the plan";
      step = line["step"];
    }
    last = line;
  }
  EXPECT_EQ(step, last["steps"]);
  EXPECT_NEAR(share, 1, 1e-9);
  EXPECT_NEAR(last["eta_seconds"].get<double>(), 0, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Methods, BuildProgress,
                         testing::Values(std::vector<std::string>{}, std::vector<std::string>{"--levels", "3"},
                                         std::vector<std::string>{"--levels", "1"},
                                         std::vector<std::string>{"--fit-scale-ground", "2", "--level-rounds", "2",
                                                                  "--span-width-m", "0"},
                                         std::vector<std::string>{"--method", "fixed", "--resolution", "4"}));

TEST(Progress, IsNotToldWhenQuiet) {
  const TempFolder folder;
  EXPECT_EQ(run({"synth", "--points", "20000", "-o", folder / "world", "--progress", "json", "--quiet"}).err, "");
}

TEST(Progress, OfOnePhaseHasNoSteps) {
  const TempFolder folder;
  const Outcome outcome = run({"synth", "--points", "20000", "-o", folder / "world", "--progress", "json"});
  const auto lines = objects_in(outcome.err);
  ASSERT_FALSE(lines.empty());
  EXPECT_EQ(lines.back()["phase"], "synth");
  EXPECT_FALSE(lines.back().contains("step"));
  EXPECT_NEAR(lines.back()["share"].get<double>(), 1, 0.05);
}

}  // namespace
}  // namespace btms::test
