// What the program says of itself, and how it exits when it is called wrongly.
#include "tests/cli/help_text.h"

namespace btms::test {
namespace {

TEST(CliHelp, NamesEverySubcommandAndAnExample) {
  const Outcome help = run({"--help"});
  EXPECT_EQ(help.status, 0);
  EXPECT_EQ(help.err, "");
  const std::vector<std::string> names = subcommands();
  for (const char* name : {"build", "accumulate", "sweep"})
    EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
  EXPECT_NE(help.out.find("Example"), std::string::npos);
}

TEST(CliHelp, EverySubcommandTeaches) {
  for (const std::string& name : subcommands()) {
    const Outcome help = run({name, "--help"});
    EXPECT_EQ(help.status, 0) << name;
    EXPECT_NE(help.out.find("Example"), std::string::npos) << name;
    EXPECT_NE(help.out.find("btms " + name), std::string::npos) << name;
    EXPECT_NE(help.out.find("--json"), std::string::npos) << name;
    EXPECT_NE(help.out.find("--quiet"), std::string::npos) << name;
  }
}

TEST(CliHelp, EveryParameterIsAFlagOfBuildAndSegmentWithItsRange) {
  const auto params = run_json({"params"});
  ASSERT_FALSE(params["parameters"].empty());
  for (const std::string name : {"build", "segment"}) {
    const std::string help = run({name, "--help"}).out;
    for (const auto& row : params["parameters"])
      EXPECT_NE(help.find(row["flag"].get<std::string>()), std::string::npos) << row["flag"];
  }
  EXPECT_NE(run({"build", "--help"}).out.find("--resolution"), std::string::npos);
}

TEST(CliHelp, SynthNamesTheOptionsOfAScene) {
  const std::string help = run({"synth", "--help"}).out;
  for (const char* flag : {"  --scene ", "  --density ", "  --seed ", "  --origin "})
    EXPECT_NE(help.find(flag), std::string::npos) << flag << help;
}

TEST(CliHelp, EvalSaysWhatItsPictureShows) {
  const std::string help = run({"eval", "--help"}).out;
  for (const char* text : {"--picture ", "--picture-box", "X0,Y0,X1,Y1", "blue", "red", "3 pixels"})
    EXPECT_NE(help.find(text), std::string::npos) << text;
}

TEST(CliHelp, VersionNamesTheLibraries) {
  const Outcome version = run({"--version"});
  EXPECT_EQ(version.status, 0);
  EXPECT_EQ(version.out.rfind("btms ", 0), 0u) << version.out;
  for (const char* library : {"HDF5 1", "oneTBB 20", "Eigen 3", "PROJ 9", "CLI11 2", "yaml-cpp 0"})
    EXPECT_NE(version.out.find(library), std::string::npos) << version.out;
}

TEST(CliUsage, WrongCallsExitWith2) {
  const TempFolder folder;
  const std::vector<std::vector<std::string>> calls = {
      {},
      {"fly"},
      {"build"},
      {"build", folder / "a.las"},
      {"build", folder / "missing.las", "-o", folder / "m.btms"},
      {"build", folder / "a.xyz", "-o", folder / "m.btms"},
      {"params", "--preset", "moon"},
      {"params", "--threads", "0"},
      {"synth", "--scene", "moon", "-o", folder / "out"},
      {"synth", "--origin", "1;x", "-o", folder / "out"},
      {"synth", "--threads", "0", "-o", folder / "out"},
      {"eval", "--truth", folder / "none", "--prediction", folder / "none"},
      {"query", "--at", "1"},
  };
  for (const auto& call : calls) {
    const Outcome outcome = run(call);
    EXPECT_EQ(outcome.status, 2) << testing::PrintToString(call) << outcome.err;
    EXPECT_EQ(outcome.out, "") << testing::PrintToString(call);
    EXPECT_NE(outcome.err, "") << testing::PrintToString(call);
  }
  EXPECT_TRUE(names_in(folder.path()).empty());
}

TEST(CliUsage, ParametersAreRefusedByNameAndRange) {
  const TempFolder folder;
  write_scan(folder / "scan.bin", floor_and_wall());
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"--resolution", "0"},     {"--resolution-m", "1.0015"}, {"--slope-max-deg", "95"}, {"--min-points", "2.5"},
      {"--node-model", "magic"}, {"--executor", "ranks:0"},    {"--executor", "gpu"},     {"--tile-cells", "0"},
      {"--crs", "EPSG:1"},       {"--crs", "EPSG:4326"},       {"--crs", "EPSG:2992"}};
  for (const auto& [flag, value] : cases) {
    const Outcome outcome =
        run({"build", folder / "scan.bin", "-o", folder / "m.btms", flag, value, "--progress", "none"});
    EXPECT_EQ(outcome.status, 2) << flag << ' ' << value << ": " << outcome.err;
    EXPECT_FALSE(fs::exists(folder / "m.btms")) << flag;
  }
}

TEST(CliParams, ListsSymbolsRangesSourcesAndASchema) {
  const auto table = run_json({"params", "--preset", "paper-single-scan"});
  EXPECT_EQ(table["preset"], "paper-single-scan");
  for (const auto& row : table["parameters"]) {
    EXPECT_TRUE(row.contains("default"));
    EXPECT_NE(row["source"], "");
    EXPECT_TRUE(row.contains("choices") || row["max"] > row["min"]) << row;
  }
  const auto schema = run_json({"params", "--schema"});
  for (const auto& row : table["parameters"])
    EXPECT_TRUE(schema["properties"].contains(row["name"].get<std::string>()));
  EXPECT_EQ(schema["additionalProperties"], false);
  EXPECT_NE(run({"params"}).out.find("slope_max_deg"), std::string::npos);
}

}  // namespace
}  // namespace btms::test
