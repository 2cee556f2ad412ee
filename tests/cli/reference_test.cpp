// Reference systems, repeated and left out inputs: what build warns of.
#include "tests/cli/program.h"

namespace btms::test {
namespace {

class CliReference : public testing::Test {
 protected:
  void synth(const std::string& name, std::vector<std::string> more) {
    more.insert(more.begin(), {"synth", "--points", "5000", "-o", folder_ / name});
    EXPECT_EQ(run(more).status, 0);
  }
  std::string tile(const std::string& name) { return folder_ / (name + "/city.las"); }
  nlohmann::json build(std::vector<std::string> more) {
    more.insert(more.begin(), {"build", "-o", folder_ / "map.btms"});
    return run_json(more);
  }
  TempFolder folder_;
};

TEST_F(CliReference, AContradictionNamesBoth) {
  synth("utm", {"--crs", "EPSG:25832"});
  const auto other = build({tile("utm"), "--crs", "28992"});
  ASSERT_EQ(other["warnings"].size(), 1u) << other["warnings"];
  const std::string warning = other["warnings"][0];
  EXPECT_NE(warning.find("EPSG:25832"), std::string::npos) << warning;
  EXPECT_NE(warning.find("EPSG:28992"), std::string::npos) << warning;
  EXPECT_NE(run({"info", folder_ / "map.btms"}).out.find("EPSG:28992"), std::string::npos);
  EXPECT_TRUE(build({tile("utm"), "--crs", "EPSG:25832"})["warnings"].empty());
}

// One place, its halves from two zones: (700000, 5600000) in zone 32 is (274670.5, 5601024.6) in zone 33.
TEST_F(CliReference, InputsInDifferentSystemsBecomeOneMap) {
  synth("west", {"--crs", "EPSG:25832", "--origin", "700000,5600000"});
  synth("east", {"--crs", "EPSG:25833", "--origin", "274671,5601025"});
  const auto both = build({tile("west"), tile("east")});
  ASSERT_EQ(both["warnings"].size(), 1u) << both["warnings"];
  const std::string warning = both["warnings"][0];
  EXPECT_NE(warning.find("converted from ETRS89 / UTM zone 33N"), std::string::npos) << warning;
  EXPECT_NE(warning.find("EPSG:25832"), std::string::npos) << warning;
  EXPECT_EQ(both["dropped"]["strays"], 0);
  EXPECT_LT(both["extent_m"][2].get<double>() - both["extent_m"][0].get<double>(), 400);
  EXPECT_NEAR(both["extent_m"][0].get<double>(), 700'000, 64);

  // Labels and updates convert as the build did.
  const auto labels = run_json({"label", folder_ / "map.btms", tile("east"), "-o", folder_ / "labels"});
  EXPECT_EQ(labels["total"]["outside"], 0);
  EXPECT_EQ(labels["warnings"].size(), 1u);
  EXPECT_EQ(run_json({"build", "-o", folder_ / "map.btms", "--update"})["digest"], both["digest"]);

  const auto there = build({tile("west"), tile("east"), "--to-crs", "EPSG:25833"});
  EXPECT_NEAR(there["extent_m"][0].get<double>(), 274'670, 64);
  EXPECT_NE(there["digest"], both["digest"]);

  // Taken to be in one system they are 400 km apart.
  const auto apart = build({tile("west"), tile("east"), "--crs", "EPSG:25832"});
  EXPECT_EQ(apart["dropped"]["strays"], 0);
  EXPECT_GT(apart["extent_m"][2].get<double>() - apart["extent_m"][0].get<double>(), 400'000);
  EXPECT_EQ(run_json({"label", folder_ / "map.btms", tile("east"), "-o", folder_ / "apart"})["total"]["outside"], 0);
}

TEST_F(CliReference, HeightsOfTwoKindsAreRefused) {
  synth("a", {"--crs", "EPSG:25832+5783"});
  synth("b", {"--crs", "EPSG:25832+7837"});
  synth("c", {"--crs", "EPSG:25832"});
  const Outcome mixed = run({"build", tile("a"), tile("b"), "-o", folder_ / "map.btms"});
  EXPECT_EQ(mixed.status, 3);
  EXPECT_NE(mixed.err.find("DHHN92 height, DHHN2016 height"), std::string::npos) << mixed.err;
  build({tile("c"), tile("a")});
  const std::string crs = run_json({"info", folder_ / "map.btms"})["crs"];
  EXPECT_NE(crs.find("DHHN92"), std::string::npos) << crs;
}

TEST_F(CliReference, WhatIsNeitherACodeNorWktIsRefused) {
  synth("plain", {});
  for (const std::string crs : {"foo", "Amersfoort / RD New", "EPSG:", "EPSG:0", "99999999", "PROJCS[oops"}) {
    const Outcome outcome = run({"build", tile("plain"), "-o", folder_ / "map.btms", "--crs", crs});
    EXPECT_NE(outcome.status, 0) << crs;
    EXPECT_EQ(outcome.err.find("metre"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("WKT"), std::string::npos) << outcome.err;
  }
}

TEST_F(CliReference, FilesFarApartWithoutASystem) {
  synth("here", {});
  synth("near", {"--origin", "90000,0"});
  synth("there", {"--origin", "180000,0"});
  const auto apart = build({tile("here"), tile("there")});
  ASSERT_EQ(apart["warnings"].size(), 1u) << apart["warnings"];
  const std::string warning = apart["warnings"][0];
  EXPECT_NE(warning.find(tile("here")), std::string::npos) << warning;
  EXPECT_NE(warning.find(tile("there")), std::string::npos) << warning;
  EXPECT_TRUE(build({tile("here"), tile("there"), tile("near")})["warnings"].empty());
  EXPECT_TRUE(build({tile("here"), tile("there"), "--crs", "EPSG:25832"})["warnings"].empty());
}

TEST_F(CliReference, AFileCountsOnce) {
  synth("a", {});
  const auto once = build({tile("a")});
  const auto twice = build({folder_ / "a", folder_ / "a/../a/city.las"});
  EXPECT_EQ(twice["digest"], once["digest"]);
  EXPECT_EQ(twice["inputs"].size(), 1u);
  ASSERT_EQ(twice["warnings"].size(), 1u) << twice["warnings"];
  EXPECT_NE(twice["warnings"][0].get<std::string>().find("more than once"), std::string::npos) << twice["warnings"];
}

TEST_F(CliReference, AMapWithoutTerrainIsWarnedOf) {
  write_scan(folder_ / "few.bin", {{1, 1, 0}, {2, 2, 0}, {3, 3, 0}});
  const auto built = build({folder_ / "few.bin", "--picture", folder_ / "a.png"});
  ASSERT_EQ(built["warnings"].size(), 1u);
  EXPECT_NE(built["warnings"][0].get<std::string>().find("--min-points"), std::string::npos);
  EXPECT_NE(run({"info", folder_ / "map.btms"}).out.find("no surface"), std::string::npos);
}

}  // namespace
}  // namespace btms::test
