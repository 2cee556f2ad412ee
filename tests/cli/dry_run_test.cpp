// btms build --dry-run: what it forecasts against what then happens.
#include <cmath>

#include "tests/cli/program.h"

namespace btms::test {
namespace {

std::uint64_t bytes_in(const fs::path& folder) {
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) bytes += entry.file_size();
  return bytes;
}

void expect_within(double forecast, double happened, const char* what) {
  EXPECT_GE(forecast, 0.75 * happened) << what;
  EXPECT_LE(forecast, 1.25 * happened) << what;
}

// Time is left out: other tests run beside this one.
void expect_good_forecast(const std::vector<std::string>& world, std::vector<std::string> options) {
  const TempFolder folder;
  std::vector<std::string> synth = {"synth", "-o", folder / "world"};
  synth.insert(synth.end(), world.begin(), world.end());
  run_json(synth);
  std::vector<std::string> build = {"build", folder / "world", "-o", folder / "map"};
  build.insert(build.end(), options.begin(), options.end());
  std::vector<std::string> dry = build;
  dry.emplace_back("--dry-run");
  const auto told = run_json(dry);
  EXPECT_EQ(names_in(folder.path()), std::vector<std::string>{"world"}) << "a dry run writes nothing";

  const auto happened = run_json(build);
  expect_within(told["points"], happened["points"], "points");
  expect_within(told["tiles"], happened["tiles"], "tiles");
  expect_within(told["nodes"], happened["nodes"]["total"], "nodes");
  expect_within(told["memory_bytes"], happened["peak_rss_bytes"], "memory");
  expect_within(told["map_bytes"], static_cast<double>(bytes_in(folder / "map")), "map");
  expect_within(told["density_per_m2"], 10, "density");
  EXPECT_GT(told["seconds"], 0);
}

TEST(DryRun, TellsWhatALevelledBuildTakes) { expect_good_forecast({"--points", "300000"}, {"--preset", "city"}); }

TEST(DryRun, TellsTheSameOfASampleOfManyPoints) {
  expect_good_forecast({"--points", "4000000", "--files", "3", "--origin", "-900,5000"},
                       {"--preset", "city", "--method", "fixed", "--resolution", "4"});
}

TEST(DryRun, SeesThatWaterIsNoLand) {  // two worlds two kilometres apart
  const TempFolder folder;
  run_json({"synth", "--points", "50000", "-o", folder / "a"});
  run_json({"synth", "--points", "50000", "--origin", "2000,2000", "-o", folder / "b"});
  const std::vector<std::string> build = {"build", folder / "a", folder / "b", "-o", folder / "map"};
  auto dry = build;
  dry.emplace_back("--dry-run");
  const auto told = run_json(dry), happened = run_json(build);
  expect_within(told["nodes"], happened["nodes"]["total"], "nodes");
  expect_within(told["area_m2"], 10'000, "area");
}

TEST(DryRun, BearsStraysAndPointsThatAreNoNumbers) {
  const TempFolder folder;
  std::vector<std::array<float, 3>> points;
  for (int i = 0; i < 500'000; ++i)
    points.push_back({0.1f * static_cast<float>(i % 700), 0.1f * static_cast<float>(i / 700), 0});
  for (std::size_t i = 249'000; i < 251'000; ++i) points[i][0] = i % 2 == 0 ? NAN : 90'000.f;
  write_scan(folder / "scan.bin", points);
  const std::vector<std::string> build = {"build",        folder / "scan.bin", "-o",
                                          folder / "map", "--preset",          "paper-single-scan"};
  auto dry = build;
  dry.emplace_back("--dry-run");
  const auto told = run_json(dry), happened = run_json(build);
  EXPECT_EQ(told["points"], happened["points"]);
  expect_within(told["points_per_node"], 400, "points in a node of 4 m2");
  EXPECT_GT(told["seconds"], 0);
}

TEST(DryRun, RefusesWhatABuildRefuses) {
  const TempFolder folder;
  run_json({"synth", "--points", "20000", "-o", folder / "world"});
  const Outcome outcome = run({"build", folder / "world", "-o", folder / "map", "--dry-run", "--max-nodes", "10"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("max-nodes"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace btms::test
