// The coarse-to-fine method node by node: fits do not depend on order, steps and links are symmetric, verdicts are what
// they say.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "engine/terrain/level_fit.h"
#include "engine/terrain/level_links.h"
#include "engine/terrain/parameters.h"
#include "tests/support/cloud.h"

namespace btms::test {
namespace {

struct LevelCloud {
  std::vector<std::int16_t> x, y;
  std::vector<std::int32_t> z;
  void add(std::int64_t px, std::int64_t py, std::int64_t pz) {
    x.push_back(static_cast<std::int16_t>(px));
    y.push_back(static_cast<std::int16_t>(py));
    z.push_back(static_cast<std::int32_t>(pz));
  }
  NodePoints points() const { return {x.data(), y.data(), z.data(), x.size()}; }
};

GatedPoints gated;  // reused memory of the fits

const LevelRules kFine(preset("city"), 2000, false, true), kFirst(preset("city"), 32000, true, false);

TEST(LevelFit, FindsTheGroundUnderWhatStandsOnIt) {
  Random random(1);
  LevelCloud c;
  for (int i = 0; i < 12; ++i) {
    const std::int64_t x = random.between(300, 900), y = random.between(-250, 250);
    c.add(x, y, 10'000 + x / 5 + random.between(-20, 20));
  }
  for (int i = 0; i < 60; ++i)
    c.add(random.between(300, 900), random.between(-250, 250), random.between(11'000, 18'000));
  const PriorPlane prior{10'300, 0.1, 0, 50};
  const LevelNode n = fit_level_node(c.points(), kEast, prior, kFine, gated);
  ASSERT_EQ(n.level_class, LevelClass::kNear);
  EXPECT_NEAR(n.mean_z_mm, 10'000 + n.mean_x_mm / 5, 30);
  EXPECT_EQ(n.count, 72);
}

// Every sum one point at a time, in integers.
TEST(LevelMoments, AreThoseOfIntegers) {
  Random random(7);
  for (const std::int64_t count : {1, 3, 4, 5, 64, 4096, 9001}) {
    LevelCloud c;
    for (std::int64_t i = 0; i < count; ++i)
      c.add(random.between(-32'767, 32'767), random.between(-32'767, 32'767), random.between(-300'000, 300'000));
    const double scale_mm = static_cast<double>(random.between(1, 30'000));
    const FixedLevelPlane plane{random.between(-8000, 8000), random.between(-8000, 8000),
                                random.between(-100, 100) << 20};
    FixedLevelPlane gate = plane;
    gate.c -= std::int64_t{150'000} << FixedLevelPlane::kBits;
    const std::int64_t lowest = gated.assign(c.points(), 17, gate);
    const WeightedMoments sums = WeightedMoments::of(gated, plane, scale_mm);

    WeightedMoments m;
    std::int64_t least = INT64_MAX;
    const auto per_residual =
        static_cast<std::uint64_t>(256 / (4 * scale_mm * FixedLevelPlane::kUnit) * 4294967296.0 + 0.5);
    for (std::size_t i = 0; i < c.x.size(); ++i) {
      const std::int64_t x = c.x[i], y = c.y[i], z = std::clamp<std::int64_t>(c.z[i] - 17, -(1 << 18), 1 << 18);
      if (gate.above(x, y, z) < 0) continue;
      least = std::min(least, gate.above(x, y, z));
      const std::int64_t e = plane.above(x, y, z), r = e >> FixedLevelPlane::kBits;
      const auto step =
          e > 0 ? static_cast<std::uint64_t>((static_cast<unsigned __int128>(e) * per_residual) >> 32) : 0;
      const double q = (static_cast<double>(step) + 0.5) / 64;
      const std::int64_t w = step >= 256 ? 0 : static_cast<std::int64_t>(256 / (1 + q * q * (q * q)) + 0.5);
      m.n += w, m.x += w * x, m.y += w * y, m.z += w * z;
      m.xx += w * x * x, m.xy += w * x * y, m.xz += w * x * z, m.yy += w * y * y, m.yz += w * y * z;
      m.rr += w * std::min(r * r, std::int64_t{1} << 30);
    }
    EXPECT_EQ(lowest, least);
    EXPECT_EQ(sums, m) << count;
  }
}

TEST(LevelFit, DoesNotDependOnTheOrderOfPoints) {
  Random random(2);
  for (int round = 0; round < 400; ++round) {
    const bool first = round % 4 == 0;
    const std::int64_t reach = first ? 15'000 : 900;
    LevelCloud c, back;
    for (std::int64_t i = random.between(1, 40); i > 0; --i)
      c.add(random.between(-reach, reach), random.between(-reach, reach), random.between(-2000, 6000));
    back = c;
    std::reverse(back.x.begin(), back.x.end());
    std::reverse(back.y.begin(), back.y.end());
    std::reverse(back.z.begin(), back.z.end());
    const PriorPlane prior{static_cast<double>(random.between(-500, 500)), 0.13, -0.4, 120};
    const LevelRules& rules = first ? kFirst : kFine;
    const LevelNode a = fit_level_node(c.points(), kNorth, prior, rules, gated),
                    b = fit_level_node(back.points(), kNorth, prior, rules, gated);
    EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
  }
}

TEST(LevelFit, WithoutPointsItIsThePrior) {
  const PriorPlane prior{1234, 0.25, -0.5, 77};
  const LevelNode n = fit_level_node({}, kWest, prior, kFine, gated);
  EXPECT_EQ(n.level_class, LevelClass::kEmpty);
  EXPECT_NEAR(n.mean_z_mm, prior.at(n.mean_x_mm, n.mean_y_mm), 1);
  EXPECT_NEAR(n.slope_x / kSlopeUnit, 0.25, 1e-4);
}

TEST(LevelFit, PointsFarBelowThePriorAreNoise) {
  LevelCloud c;
  c.add(500, 0, -20'000);
  EXPECT_EQ(fit_level_node(c.points(), kEast, {0, 0, 0, 50}, kFine, gated).level_class, LevelClass::kEmpty);
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
  EXPECT_TRUE(rejected({.nodes = 3, .above_mm = -3 * 2000, .tolerance_mm = 3 * 460, .above = false}, {}, kFine))
      << "low noise";
}

}  // namespace
}  // namespace btms::test
