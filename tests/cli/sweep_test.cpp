// btms sweep: every value is a row, with and without completion.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "tests/cli/program.h"

namespace btms::test {
namespace {

TEST(CliSweep, WritesARowForEveryValueWithAndWithoutCompletion) {
  const TempFolder folder;
  ASSERT_EQ(run({"synth", "--scene", "city", "--points", "60000", "-o", folder / "scene"}).status, 0);
  const std::vector<std::string> call = {"sweep",          "--points",         folder / "scene",
                                         "--over",         "resolution=2,4,8", "-o",
                                         folder / "sweep", "--preset",         "paper-partial-map"};
  const auto json = run_json(call);
  ASSERT_EQ(json["rows"].size(), 6u);
  EXPECT_EQ(json["rows"][0]["parameter"], "resolution_m");
  EXPECT_EQ(json["rows"][0]["value"], 2);
  EXPECT_EQ(json["rows"][0]["completion"], "kernel");
  EXPECT_EQ(json["rows"][1]["completion"], "none");
  double least = 1, greatest = 0;
  for (const auto& row : json["rows"]) {
    if (row["completion"] != "kernel") continue;
    const double accuracy = row["without_ambiguous"]["accuracy"]["mean"];
    least = std::min(least, accuracy), greatest = std::max(greatest, accuracy);
  }
  EXPECT_GT(greatest, 0.5);
  EXPECT_GT(greatest, least);  // the values were used
  EXPECT_NEAR(json["spread_of_accuracy"]["resolution_m"]["kernel"], greatest - least, 1e-9);
  EXPECT_NE(json["rows"][0]["without_ambiguous"], json["rows"][1]["without_ambiguous"]);

  const std::string csv = read_text(folder / "sweep/sweep.csv"), svg = read_text(folder / "sweep/sweep.svg");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 7);
  EXPECT_EQ(csv.substr(0, 27), "parameter,value,completion,");
  EXPECT_NE(csv.find("\nresolution_m,8,none,1,"), std::string::npos) << csv;
  EXPECT_EQ(svg.substr(0, 4), "<svg");
  EXPECT_NE(svg.find("</svg>"), std::string::npos);

  EXPECT_EQ(run(call).status, 2);  // nothing is replaced unasked
}

TEST(CliSweep, RefusesTruthThatDoesNotFit) {
  const TempFolder folder;
  write_scan(folder / "a.bin", floor_and_wall());
  write_scan(folder / "b.bin", floor_and_wall());
  const std::size_t points = floor_and_wall().size();
  write_text(folder / "a.label", std::string(4 * points, '\0'));  // every point unlabelled, so ignored
  const std::vector<std::string> two = {
      "sweep", "--points", folder / "a.bin", folder / "b.bin", "--truth", folder / "a.label", "-o", folder / "sweep"};
  const Outcome one_for_two = run(two);
  EXPECT_EQ(one_for_two.status, 2);
  EXPECT_NE(one_for_two.err.find("one file for 2 inputs"), std::string::npos) << one_for_two.err;
  const Outcome nothing = run({"sweep", "--points", folder / "a.bin", "--truth", folder / "a.label", "--over",
                               "resolution=4", "-o", folder / "sweep"});
  EXPECT_EQ(nothing.status, 3) << nothing.out;
  EXPECT_FALSE(fs::exists(folder / "sweep/sweep.csv"));
}

TEST(CliSweep, LeavesOutAndCountsWhatIsNotFinite) {
  const TempFolder folder;
  auto points = floor_and_wall();
  points[3][1] = std::numeric_limits<float>::infinity();
  write_scan(folder / "a.bin", points);
  std::string labels(4 * points.size(), '\0');
  for (std::size_t i = 0; i < points.size(); ++i) labels[4 * i] = points[i][2] < -1.6f ? 40 : 50;
  write_text(folder / "a.label", labels);
  const auto json = run_json({"sweep", "--points", folder / "a.bin", "--truth", folder / "a.label", "--over",
                              "resolution=2,4", "-o", folder / "sweep"});
  EXPECT_EQ(json["dropped"], 1);
}

TEST(CliSweep, SaysWhatIsWrongWithAnAxis) {
  const TempFolder folder;
  ASSERT_EQ(run({"synth", "--scene", "city", "--points", "20000", "-o", folder / "scene"}).status, 0);
  for (const char* over :
       {"resolution", "resolution=", "resolution=0", "resolution=1,,2", "node_model=pca", "size=1"}) {
    const Outcome wrong = run({"sweep", "--points", folder / "scene", "--over", over, "-o", folder / "sweep"});
    EXPECT_EQ(wrong.status, 2) << over << wrong.err;
  }
  EXPECT_FALSE(fs::exists(folder / "sweep"));
}

}  // namespace
}  // namespace btms::test
