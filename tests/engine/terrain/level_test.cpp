// The coarse-to-fine method node by node: fits do not depend on order, steps and links are symmetric, verdicts are what
// they say.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "engine/terrain/level_fit.h"
#include "engine/terrain/level_links.h"
#include "engine/terrain/parameters.h"
#include "tests/support/cloud.h"
#include "tests/support/node_cloud.h"

namespace btms::test {
namespace {

GatedPoints gated;  // reused memory of the fits

const LevelRules kFine(preset("city"), 2000, false, true), kFirst(preset("city"), 32000, true, false);

TEST(LevelFit, FindsTheGroundUnderWhatStandsOnIt) {
  Random random(1);
  NodeCloud c;
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

// The same fit point by point and in integers.
FittedPlane fit_slowly(const NodeCloud& c, std::int32_t datum, const FixedLevelPlane& gate, const PlaneStart& start,
                       const PlaneFitRules& rules) {
  constexpr int kBits = FixedLevelPlane::kBits;
  FixedLevelPlane plane = start.plane;
  FittedPlane out;
  for (int fit = 0; fit < rules.fits; ++fit) {
    const double scale = fit == rules.fits - 1 ? start.last_scale_mm : start.scale_mm;
    const auto per_residual = static_cast<unsigned __int128>(256 / (4 * scale * (1 << kBits)) * 4294967296.0 + 0.5);
    std::int64_t n = 0, sx = 0, sy = 0, sz = 0, xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, rr = 0;
    for (std::size_t i = 0; i < c.x.size(); ++i) {
      const std::int64_t x = c.x[i], y = c.y[i], z = std::clamp(c.z[i] - datum, -(1 << 18), 1 << 18);
      if (gate.above(x, y, z) < 0) continue;
      const std::int64_t e = plane.above(x, y, z), r = e >> kBits;
      const auto step =
          e > 0 ? static_cast<std::uint64_t>((static_cast<unsigned __int128>(e) * per_residual) >> 32) : 0;
      const double q = (static_cast<double>(step) + 0.5) / 64;
      const std::int64_t w = step >= 256 ? 0 : static_cast<std::int64_t>(256 / (1 + q * q * (q * q)) + 0.5);
      n += w, sx += w * x, sy += w * y, sz += w * z, rr += w * std::min(r * r, std::int64_t{1} << 30);
      xx += w * x * x, xy += w * x * y, xz += w * x * z, yy += w * y * y, yz += w * y * z;
    }
    const auto real = [](std::int64_t v) { return static_cast<double>(v); };
    const double n2 = real(n) * real(n);
    out.weight = real(n) / 256;
    if (out.weight < rules.least_weight) return out;
    const auto central = [&](std::int64_t ab, std::int64_t a, std::int64_t b) {
      return static_cast<double>(static_cast<__int128>(n) * ab - static_cast<__int128>(a) * b) / n2;
    };
    out.x_mm = real(sx) / real(n), out.y_mm = real(sy) / real(n), out.z_mm = real(sz) / real(n);
    const double ridge = rules.ridge_mm2 * (rules.ridge_per_weight ? 1 / out.weight : 1.0);
    const double cxx = central(xx, sx, sx) + ridge, cxy = central(xy, sx, sy), cyy = central(yy, sy, sy) + ridge;
    const double cxz = central(xz, sx, sz) + ridge * start.slope_x, cyz = central(yz, sy, sz) + ridge * start.slope_y;
    const double det = cxx * cyy - cxy * cxy;
    out.slope_x = std::clamp((cxz * cyy - cyz * cxy) / det, -7.9, 7.9);
    out.slope_y = std::clamp((cyz * cxx - cxz * cxy) / det, -7.9, 7.9);
    plane = FixedLevelPlane::of(out.slope_x, out.slope_y, out.z_mm - out.slope_x * out.x_mm - out.slope_y * out.y_mm);
    out.rms_mm = std::sqrt(real(rr) / real(n));
  }
  out.fitted = true;
  return out;
}

// Lanes of very different lengths, empty ones, sums beyond what a double holds, points on both limits.
TEST(LevelPlanes, AreThoseOfIntegersInEveryLane) {
  Random random(7);
  int fitted = 0;
  for (int round = 0; round < 300; ++round) {
    const bool heavy = round % 60 == 0;
    const std::int64_t reach = round % 3 == 0 ? 32'767 : 1'000, most = heavy ? 60'000 : 1 << round % 9;
    const PlaneFitRules rules{round % 2 ? 4 : 8, static_cast<double>(random.between(1, 1 << 20)), round % 2 == 1,
                              round % 2 ? 0.5 : 2.0};
    gated.clear();
    PlaneStarts starts;
    std::array<NodeCloud, 4> clouds;
    std::array<FixedLevelPlane, 4> gates;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::int64_t relief = heavy || random.between(0, 3) == 0 ? 300'000 : random.between(1, 4000);
      for (std::int64_t i = random.between(0, most); i > 0; --i)
        clouds[k].add(random.between(heavy ? 30'000 : -reach, reach), random.between(-reach, reach),
                      random.between(-relief, relief));
      starts[k] = {{random.between(-8000, 8000), random.between(-8000, 8000), random.between(-100, 100) << 16},
                   static_cast<double>(random.between(-100, 100)) / 64,
                   static_cast<double>(random.between(-100, 100)) / 64,
                   static_cast<double>(random.between(1, 3000)),
                   static_cast<double>(random.between(1, 150))};
      if (heavy) starts[k].plane = {};
      gates[k] = starts[k].plane;
      gates[k].c -= random.between(0, heavy ? 400'000 : 2000) << FixedLevelPlane::kBits;
      gated.assign(k, clouds[k].points(), 17, gates[k]);
    }
    gated.pad();
    const auto fits = fit_planes(gated, starts, rules);
    for (std::size_t k = 0; k < 4; ++k) {
      const FittedPlane slow = fit_slowly(clouds[k], 17, gates[k], starts[k], rules);
      ASSERT_EQ(fits[k].fitted, slow.fitted) << round << " lane " << k;
      if (!slow.fitted) continue;
      ++fitted;
      const auto values = [](const FittedPlane& p) {
        return std::array{p.x_mm, p.y_mm, p.z_mm, p.slope_x, p.slope_y, p.weight, p.rms_mm};
      };
      EXPECT_EQ(values(fits[k]), values(slow)) << round << " lane " << k;
    }
  }
  EXPECT_GT(fitted, 400);
}

TEST(LevelFit, TheNodesOfASquareDoNotSeeEachOther) {
  Random random(8);
  for (int round = 0; round < 100; ++round) {
    std::array<NodeCloud, 4> clouds;
    SquarePoints points;
    SquarePriors priors;
    for (std::size_t t = 0; t < 4; ++t) {
      for (std::int64_t i = random.between(0, 9); i > 0; --i)
        clouds[t].add(random.between(-900, 900), random.between(-900, 900), random.between(-500, 3000));
      points[t] = clouds[t].points();
      priors[t] = {static_cast<double>(random.between(-300, 300)), 0.1, -0.2, 40};
    }
    std::array<LevelNode, 4> together;
    fit_level_square(points, priors, kFine, gated, together.data());
    for (std::uint8_t t = 0; t < 4; ++t) {
      const LevelNode alone = fit_level_node(points[t], t, priors[t], kFine, gated);
      EXPECT_EQ(std::memcmp(&alone, &together[t], sizeof alone), 0);
    }
  }
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
  NodeCloud c;
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
