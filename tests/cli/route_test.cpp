// btms route, and the same way asked of the library.
#include <cmath>

#include "tests/cli/program.h"

namespace btms::test {
namespace {

class CliRoute : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TempFolder>();
    run_json({"synth", "--points", "2000000", "-o", *folder_ / "truth"});
    run_json({"build", *folder_ / "truth", "-o", map()});
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::string map() { return *folder_ / "city.btms"; }
  static std::vector<std::string> across(std::vector<std::string> more = {}) {
    std::vector<std::string> words = {"route", map(), "--from", "215,95", "--to", "390,280"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  static std::unique_ptr<TempFolder> folder_;
};
std::unique_ptr<TempFolder> CliRoute::folder_;

TEST_F(CliRoute, TheSameWayInEveryForm) {
  const nlohmann::json json = run_json(across());
  ASSERT_EQ(json["status"], "found");
  const auto& points = json["points"];
  ASSERT_GT(points.size(), 1u);
  const double straight = std::hypot(points.back()[0].get<double>() - points[0][0].get<double>(),
                                     points.back()[1].get<double>() - points[0][1].get<double>());
  EXPECT_GE(json["length_m"].get<double>(), straight);
  EXPECT_GT(json["weight"], json["length_m"]);
  EXPECT_LE(json["steepest_deg"].get<double>(), 20.5);

  const Outcome text = run(across({"-o", *folder_ / "way.geojson", "--picture", *folder_ / "way.png"}));
  ASSERT_EQ(text.status, 0) << text.err;
  std::istringstream lines(text.out);
  std::size_t read = 0;
  std::string asked;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) continue;
    double x = 0, y = 0, z = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf %lf %lf", &x, &y, &z), 3) << line;
    ASSERT_LT(read, points.size());
    EXPECT_NEAR(points[read][0].get<double>(), x, 6e-4);
    EXPECT_NEAR(points[read][1].get<double>(), y, 6e-4);
    EXPECT_NEAR(points[read][2].get<double>(), z, 6e-4);
    asked += std::to_string(x) + " " + std::to_string(y) + "\n";
    ++read;
  }
  EXPECT_EQ(read, points.size());
  const nlohmann::json heights = run_json({"query", map()}, asked)["places"];
  for (std::size_t i = 0; i < read; ++i) EXPECT_NEAR(heights[i]["z"].get<double>(), points[i][2].get<double>(), 2e-3);

  const nlohmann::json geo = nlohmann::json::parse(read_text(*folder_ / "way.geojson"));
  EXPECT_EQ(geo["features"][0]["geometry"]["type"], "LineString");
  EXPECT_EQ(geo["features"][0]["geometry"]["coordinates"], points);
  EXPECT_EQ(geo["features"][0]["properties"]["length_m"], json["length_m"]);
  EXPECT_TRUE(read_text(*folder_ / "way.png").starts_with("\x89PNG"));
  EXPECT_EQ(run(across({"-o", *folder_ / "way.geojson"})).status, 2) << "it is there already";
}

TEST_F(CliRoute, TheShortestWayIsNoLonger) {
  EXPECT_LE(run_json(across({"--cost-weight", "0"}))["length_m"].get<double>(),
            run_json(across())["length_m"].get<double>() * (1 + 1e-9));
}

TEST_F(CliRoute, SaysWhyThereIsNone) {
  const Outcome outside = run({"route", map(), "--from", "9e5,9e5", "--to", "1,1", "--json"});
  EXPECT_EQ(outside.status, 1);
  EXPECT_EQ(outside.json()["status"], "no_start");
  EXPECT_NE(outside.err.find("--from 9e5,9e5"), std::string::npos) << outside.err;
  const Outcome wide = run(across({"--vehicle-width-m", "900", "--json"}));
  EXPECT_EQ(wide.status, 1);
  EXPECT_EQ(wide.json()["status"], "no_start");
}

}  // namespace
}  // namespace btms::test
