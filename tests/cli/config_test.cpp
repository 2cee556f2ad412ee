// Preset, then config file, then flags.
#include "tests/cli/program.h"

namespace btms::test {
namespace {

class CliConfig : public testing::Test {
 protected:
  CliConfig() { write_scan(folder_ / "scan.bin", floor_and_wall()); }
  std::vector<std::string> build(std::vector<std::string> more) {
    more.insert(more.begin(), {"build", folder_ / "scan.bin", "-o", folder_ / "map.btms"});
    return more;
  }
  TempFolder folder_;
};

double default_of(const std::string& preset, const std::string& name) {
  const auto table = run_json({"params", "--preset", preset});
  for (const auto& row : table["parameters"])
    if (row["name"] == name) return row["default"];
  return -1;
}

TEST_F(CliConfig, RisingOrder) {
  write_text(folder_ / "c.yaml", "# a comment\nslope_max_deg: 31\nkeep_nodes: 5\n");
  const auto only_preset = run_json(build({"--preset", "paper-single-scan"}))["parameters"];
  EXPECT_EQ(only_preset["slope_max_deg"], default_of("paper-single-scan", "slope_max_deg"));
  const auto with_file =
      run_json(build({"--preset", "paper-single-scan", "--config", folder_ / "c.yaml"}))["parameters"];
  EXPECT_EQ(with_file["slope_max_deg"], 31);
  EXPECT_EQ(with_file["resolution_m"], default_of("paper-single-scan", "resolution_m"));
  const auto with_flag = run_json(
      build({"--slope-max-deg", "32", "--preset", "paper-single-scan", "--config", folder_ / "c.yaml"}))["parameters"];
  EXPECT_EQ(with_flag["slope_max_deg"], 32);
  EXPECT_EQ(with_flag["keep_nodes"], 5);
}

TEST_F(CliConfig, APresetInTheFileYieldsToTheFlag) {
  write_text(folder_ / "c.yaml", "slope_max_deg: 31\npreset: paper-single-scan\n");
  const auto file = run_json(build({"--config", folder_ / "c.yaml"}));
  EXPECT_EQ(file["preset"], "paper-single-scan");
  EXPECT_EQ(file["parameters"]["resolution_m"], default_of("paper-single-scan", "resolution_m"));
  EXPECT_EQ(file["parameters"]["slope_max_deg"], 31);
  EXPECT_EQ(run_json(build({"--config", folder_ / "c.yaml", "--preset", "city"}))["preset"], "city");
}

TEST_F(CliConfig, BothNamesOfTheResolution) {
  EXPECT_EQ(run_json(build({"--resolution", "3"}))["parameters"]["resolution_m"], 3);
  EXPECT_EQ(run_json(build({"--resolution-m", "3"}))["parameters"]["resolution_m"], 3);
}

TEST_F(CliConfig, MistakesNameFileAndLine) {
  const std::pair<const char*, const char*> cases[] = {
      {"slope_max_deg: 20\nslope_max_dge: 30\n", "line 2"},
      {"slope_max_deg: 95\n", "slope_max_deg"},
      {"slope_max_deg: [1, 2]\n", "slope_max_deg"},
      {"just a sentence\n", "c.yaml"},
      {"a: [\n", "c.yaml"},
  };
  for (const auto& [text, expected] : cases) {
    write_text(folder_ / "c.yaml", text);
    const Outcome outcome = run(build({"--config", folder_ / "c.yaml"}));
    EXPECT_EQ(outcome.status, 2) << text << outcome.err;
    EXPECT_NE(outcome.err.find(expected), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("c.yaml"), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(run(build({"--config", folder_ / "missing.yaml"})).status, 2);
}

}  // namespace
}  // namespace btms::test
