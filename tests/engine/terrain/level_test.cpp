// The coarse-to-fine method node by node: fits do not depend on order, steps and links are symmetric, verdicts are what
// they say.
#include <gtest/gtest.h>

#include <cstring>

#include "engine/terrain/level_fit.h"
#include "engine/terrain/level_links.h"
#include "engine/terrain/parameters.h"
#include "tests/support/cloud.h"
#include "tests/support/node_cloud.h"

namespace btms::test {
namespace {

const LevelRules kFine(preset("city"), 2000, false, true), kFirst(preset("city"), 32000, true, false);

TEST(LevelFit, FindsTheGroundUnderWhatStandsOnIt) {
  Random random(1);
  NodeCloud c;
  for (int i = 0; i < 12; ++i) {
    const std::int64_t x = random.between(300, 900), y = random.between(-250, 250);
    c.add(x, y, 10'000 + x / 5 + random.between(-20, 20));
  }
  for (int i = 0; i < 60; ++i) c.add(random.between(300, 900), random.between(-250, 250), random.between(11'000, 18'000));
  const PriorPlane prior{10'300, 0.1, 0, 50};
  const LevelNode n = fit_level_node(c.points(), kEast, prior, kFine);
  ASSERT_EQ(n.level_class, LevelClass::kNear);
  EXPECT_NEAR(n.mean_z_mm, 10'000 + n.mean_x_mm / 5, 30);
  EXPECT_EQ(n.count, 72);
}

TEST(LevelFit, DoesNotDependOnTheOrderOfPoints) {
  Random random(2);
  for (int round = 0; round < 400; ++round) {
    const bool first = round % 4 == 0;
    const std::int64_t reach = first ? 15'000 : 900;
    NodeCloud c;
    for (std::int64_t i = random.between(1, 40); i > 0; --i)
      c.add(random.between(-reach, reach), random.between(-reach, reach), random.between(-2000, 6000));
    const NodeCloud back = c.reversed();
    const PriorPlane prior{static_cast<double>(random.between(-500, 500)), 0.13, -0.4, 120};
    const LevelRules& rules = first ? kFirst : kFine;
    const LevelNode a = fit_level_node(c.points(), kNorth, prior, rules), b = fit_level_node(back.points(), kNorth, prior, rules);
    EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
  }
}

TEST(LevelFit, WithoutPointsItIsThePrior) {
  const PriorPlane prior{1234, 0.25, -0.5, 77};
  const LevelNode n = fit_level_node({}, kWest, prior, kFine);
  EXPECT_EQ(n.level_class, LevelClass::kEmpty);
  EXPECT_NEAR(n.mean_z_mm, prior.at(n.mean_x_mm, n.mean_y_mm), 1);
  EXPECT_NEAR(n.slope_x / kSlopeUnit, 0.25, 1e-4);
}

TEST(LevelFit, PointsFarBelowThePriorAreNoise) {
  NodeCloud c;
  c.add(500, 0, -20'000);
  EXPECT_EQ(fit_level_node(c.points(), kEast, {0, 0, 0, 50}, kFine).level_class, LevelClass::kEmpty);
}

TEST(LevelClassOf, NearOrAboveByItsTolerance) {
  LevelNode n;
  n.level_class = LevelClass::kNear;
  n.mean_z_mm = 400;
  classify(n, {0, 0, 0, 0}, kFine);
  EXPECT_EQ(n.level_class, LevelClass::kNear) << "0.4 m + 0.03 * 2 m";
  n.mean_z_mm = 470;
  classify(n, {0, 0, 0, 0}, kFine);
  EXPECT_EQ(n.level_class, LevelClass::kAbove);
  EXPECT_EQ(n.above_prior_mm, 470);
  EXPECT_EQ(n.tolerance_mm, 460);
}

TEST(LevelLinks, AreSymmetricToTheBit) {
  Random random(3);
  for (int i = 0; i < 50'000; ++i) {
    LevelNode a, b;
    for (LevelNode* n : {&a, &b}) {
      n->mean_x_mm = static_cast<std::int16_t>(random.between(-900, 900));
      n->mean_y_mm = static_cast<std::int16_t>(random.between(-900, 900));
      n->mean_z_mm = static_cast<std::int32_t>(random.between(-1500, 1500));
      n->slope_x = static_cast<std::int16_t>(random.between(-8000, 8000));
      n->slope_y = static_cast<std::int16_t>(random.between(-8000, 8000));
    }
    ASSERT_EQ(compare(a, b, 2000, -2000, kFine).linked, compare(b, a, -2000, 2000, kFine).linked);
  }
}

TEST(LevelVerdict, ARoofGoesABridgeAndATerraceStay) {
  const ComponentSums roof{.nodes = 400, .above_mm = 400 * 6000, .tolerance_mm = 400 * 460, .above = true};
  EXPECT_TRUE(rejected(roof, {.rim = 80, .up = 80, .agree = 0}, kFine)) << "walls all round";
  EXPECT_FALSE(rejected(roof, {.rim = 80, .up = 40, .agree = 20}, kFine)) << "agrees with the terrain at its ends";
  const ComponentSums ground{.nodes = 9000, .above_mm = 0, .tolerance_mm = 9000 * 460, .above = false};
  EXPECT_FALSE(rejected(ground, {.rim = 500, .up = 20, .agree = 0}, kFine));
  EXPECT_TRUE(rejected({.nodes = 3, .above_mm = -3 * 2000, .tolerance_mm = 3 * 460, .above = false}, {}, kFine)) << "low noise";
}

TEST(LevelVerdict, WithoutAPriorFewerWallsAreEnough) {
  const ComponentSums near{.nodes = 5, .above_mm = 0, .tolerance_mm = 5, .above = false};
  const RimCounts half{.rim = 20, .up = 9, .agree = 0};
  EXPECT_TRUE(rejected(near, half, kFirst));
  EXPECT_FALSE(rejected(near, half, kFine));
  EXPECT_FALSE(rejected(near, {.rim = 20, .up = 6, .agree = 0}, kFirst)) << "a shelf";
  EXPECT_FALSE(rejected(near, {}, kFirst)) << "all of the map";
}

TEST(LevelVerdict, ARoofWhoseHalvesVouchForEachOtherGoesAsAnIsland) {
  const ComponentSums above{.nodes = 10, .above_mm = 10 * 730, .tolerance_mm = 10 * 460, .above = true};
  const RimCounts rim_of_above{.rim = 82, .up = 48, .agree = 30};  // the lower half agrees
  EXPECT_FALSE(rejected(above, rim_of_above, kFine)) << "alone it looks like a terrace";
  const RimCounts around_both{.rim = 68, .up = 68, .agree = 0};
  EXPECT_TRUE(rejected_island({.open = 0}, around_both));
  EXPECT_TRUE(rejected_island({.open = 40}, around_both)) << "a side of it at the end of the data";
  EXPECT_FALSE(rejected_island({.open = 68}, around_both)) << "as much end of the data as walls";
  EXPECT_FALSE(rejected_island({.open = 0}, {.rim = 68, .up = 54, .agree = 0})) << "ground on a fifth of the rim";
  EXPECT_FALSE(rejected_island({.open = 500}, {})) << "nothing around it";
}

}  // namespace
}  // namespace btms::test
