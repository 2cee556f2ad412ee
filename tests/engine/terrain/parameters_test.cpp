// Presets, and how many levels a resolution leaves room for.
#include "engine/terrain/parameters.h"

#include <gtest/gtest.h>

#include "engine/error.h"

namespace btms::test {
namespace {

TEST(Presets, AreListedAndFitToBuildWith) {
  EXPECT_EQ(preset_names(),
            (std::vector<std::string>{"city", "paper-partial-map", "paper-single-scan", "partial-map", "single-scan"}));
  for (const std::string& name : preset_names()) EXPECT_NO_THROW(check(preset(name))) << name;
  try {
    preset("scan");
    FAIL();
  } catch (const Error& e) {
    for (const std::string& name : preset_names())
      EXPECT_NE(std::string(e.what()).find(name), std::string::npos) << e.what();
  }
}

TEST(Presets, OfThePaperHoldTableI) {
  const Parameters scan = preset("paper-single-scan"), map = preset("paper-partial-map");
  EXPECT_EQ(scan.resolution_m, 4);
  EXPECT_EQ(map.resolution_m, 2);
  EXPECT_EQ(scan.terrain_distance_m, 0.125);
  EXPECT_EQ(map.terrain_distance_m, 0.3);
  for (const Parameters& p : {scan, map}) {
    EXPECT_EQ(p.method, Method::kFixed);
    EXPECT_EQ(p.slope_max_deg, 20);
    EXPECT_EQ(p.min_points, 10);
    EXPECT_EQ(p.normal_similarity, 0.03);
    EXPECT_EQ(p.plane_distance, 0.1);
    EXPECT_EQ(level_count(p), 1);
  }
}

TEST(Levels, AreAsManyAsLeaveTheCoarsestALattice) {
  Parameters p = preset("partial-map");
  EXPECT_EQ(level_count(p), 6);
  for (const auto& [resolution, levels] : {std::pair{2.0, 6}, {2.1, 5}, {4.0, 5}, {8.0, 4}, {64.0, 1}}) {
    p.resolution_m = resolution;
    EXPECT_NO_THROW(check(p));
    EXPECT_EQ(level_count(p), levels) << resolution;
  }
}

}  // namespace
}  // namespace btms::test
