#include "engine/metrics/metrics.h"

#include <gtest/gtest.h>

#include "engine/error.h"

namespace btms {
namespace {

TEST(Confusion, ScoresOfATableWorkedByHand) {
  const Confusion c{.true_positive = 60, .false_positive = 20, .false_negative = 10, .true_negative = 110};
  EXPECT_EQ(c.total(), 200u);
  EXPECT_DOUBLE_EQ(c.precision(), 0.75);
  EXPECT_DOUBLE_EQ(c.recall(), 6.0 / 7);
  EXPECT_DOUBLE_EQ(c.f1(), 0.8);
  EXPECT_DOUBLE_EQ(c.accuracy(), 0.85);
  EXPECT_DOUBLE_EQ(c.type1(), 1.0 / 7);
  EXPECT_DOUBLE_EQ(c.type2(), 2.0 / 13);
  EXPECT_DOUBLE_EQ(c.total_error(), 0.15);
  // Chance agreement (80 * 70 + 120 * 130) / 200^2 = 0.53; kappa = (0.85 - 0.53) / 0.47.
  EXPECT_DOUBLE_EQ(c.kappa(), 0.32 / 0.47);
}

TEST(Confusion, KappaEndsOfTheScale) {
  EXPECT_DOUBLE_EQ((Confusion{.true_positive = 3, .true_negative = 5}).kappa(), 1);
  EXPECT_DOUBLE_EQ((Confusion{.false_positive = 4, .false_negative = 4}).kappa(), -1);
  // Independent of the truth: no better than chance.
  EXPECT_DOUBLE_EQ((Confusion{30, 30, 20, 20}).kappa(), 0);
}

TEST(Confusion, RatiosWithoutDenominatorAreZero) {
  const Confusion none;
  for (const double v : {none.precision(), none.recall(), none.f1(), none.accuracy(), none.type1(), none.type2(),
                         none.total_error(), none.kappa()})
    EXPECT_EQ(v, 0);
  const Confusion one_class{.true_positive = 7};
  EXPECT_EQ(one_class.type2(), 0);
  EXPECT_EQ(one_class.kappa(), 0);
  EXPECT_EQ(one_class.f1(), 1);
}

TEST(Confusion, SumsCountByCount) {
  Confusion c{1, 2, 3, 4};
  c += {10, 20, 30, 40};
  EXPECT_EQ(c.true_positive, 11u);
  EXPECT_EQ(c.false_positive, 22u);
  EXPECT_EQ(c.false_negative, 33u);
  EXPECT_EQ(c.true_negative, 44u);
}

TEST(Confusion, BillionsOfPointsStayExactEnough) {
  const std::uint64_t n = 40'000'000'000;
  EXPECT_DOUBLE_EQ((Confusion{6 * n, 2 * n, n, 11 * n}).kappa(), 0.32 / 0.47);
}

TEST(Score, SemanticKittiCountsVegetationByItsHeightOrNotAtAll) {
  // road, car, unlabelled, outlier, then vegetation below, at and above -0.25 * 1.73 m = -0.4325 m.
  const std::vector<std::uint32_t> truth{40, 10, 0, 1, 70, 70, 70};
  const std::vector<std::uint8_t> terrain{1, 1, 1, 1, 1, 1, 0};
  const std::vector<float> z_m{-1.7f, -1, 0, 0, -0.44f, -0.43f, 2};
  const Scores s = score(truth, terrain, z_m, semantic_kitti_rules());
  EXPECT_EQ(s.without.true_positive, 1u);
  EXPECT_EQ(s.without.false_positive, 1u);
  EXPECT_EQ(s.without.total(), 2u);
  EXPECT_EQ(s.with.true_positive, 2u);
  EXPECT_EQ(s.with.false_positive, 2u);
  EXPECT_EQ(s.with.true_negative, 1u);
  EXPECT_EQ(s.with.total(), 5u);
}

TEST(Score, SemanticKittiTerrainClasses) {
  const std::vector<std::uint32_t> truth{40, 44, 48, 49, 60, 72, 50, 51, 71, 80, 99, 252};
  const std::vector<std::uint8_t> terrain(truth.size(), 1);
  const std::vector<float> z_m(truth.size(), -1.7f);
  const Scores s = score(truth, terrain, z_m, semantic_kitti_rules());
  EXPECT_EQ(s.with.true_positive, 6u);
  EXPECT_EQ(s.with.false_positive, 6u);
}

TEST(Score, AsprsIgnoresWaterDecksAndNoise) {
  const std::vector<std::uint32_t> truth{2, 2, 1, 3, 5, 6, 7, 9, 17, 18, 20, 26};
  const std::vector<std::uint8_t> terrain{1, 0, 0, 1, 0, 0, 1, 1, 1, 1, 1, 1};
  const Scores s = score(truth, terrain, {}, asprs_rules());
  EXPECT_EQ(s.with.true_positive, 1u);
  EXPECT_EQ(s.with.false_negative, 1u);
  EXPECT_EQ(s.with.false_positive, 1u);
  EXPECT_EQ(s.with.true_negative, 3u);
  EXPECT_EQ(s.without.total(), s.with.total());
}

TEST(Score, WithoutASensorHeightAmbiguousClassesAreLeftOutOfBoth) {
  TruthRules rules = semantic_kitti_rules();
  rules.sensor_height_m = 0;
  const std::vector<std::uint32_t> truth{70, 40};
  const std::vector<std::uint8_t> terrain{1, 1};
  const Scores s = score(truth, terrain, {}, rules);
  EXPECT_EQ(s.with.total(), 1u);
  EXPECT_EQ(s.without.total(), 1u);
}

TEST(Verdict, SaysWhatBecameOfAPoint) {
  EXPECT_EQ(verdict(2, true, 0, asprs_rules()), Verdict::kTerrain);
  EXPECT_EQ(verdict(6, false, 0, asprs_rules()), Verdict::kObject);
  EXPECT_EQ(verdict(2, false, 0, asprs_rules()), Verdict::kTypeOne);
  EXPECT_EQ(verdict(6, true, 0, asprs_rules()), Verdict::kTypeTwo);
  EXPECT_EQ(verdict(9, true, 0, asprs_rules()), Verdict::kLeftOut);
  EXPECT_EQ(verdict(70, false, -0.44, semantic_kitti_rules()), Verdict::kTypeOne);
  EXPECT_EQ(verdict(70, true, -0.43, semantic_kitti_rules()), Verdict::kTypeTwo);
}

// `btms accumulate` decides ambiguous points scan by scan: 3 is terrain, 5 object, "with" only.
TEST(Score, OfAPartialMapTakesWhatWasDecided) {
  const std::vector<std::uint32_t> truth{2, 1, 3, 3, 5, 0, 7};
  const std::vector<std::uint8_t> terrain{1, 0, 1, 0, 1, 1, 1};
  const Scores s = score(truth, terrain, {}, partial_map_rules());
  EXPECT_EQ(s.with.true_positive, 2u);
  EXPECT_EQ(s.with.false_negative, 1u);
  EXPECT_EQ(s.with.false_positive, 1u);
  EXPECT_EQ(s.with.true_negative, 1u);
  EXPECT_EQ(s.without.true_positive, 1u);
  EXPECT_EQ(s.without.true_negative, 1u);
  EXPECT_EQ(s.without.total(), 2u);
}

TEST(LabelMap, RellisCountsBushesByTheirHeight) {
  const TruthRules rules = rules_of_label_map("rellis");
  for (const std::uint32_t terrain : {1, 3, 10, 15, 23, 31, 33, 34})
    EXPECT_EQ(verdict(terrain, true, 0, rules), Verdict::kTerrain) << terrain;
  for (const std::uint32_t object : {4, 5, 6, 8, 9, 12, 17, 18, 27})
    EXPECT_EQ(verdict(object, true, 0, rules), Verdict::kTypeTwo) << object;
  EXPECT_EQ(verdict(0, true, 0, rules), Verdict::kLeftOut);
  EXPECT_EQ(verdict(19, true, -0.31, rules), Verdict::kTerrain);
  EXPECT_EQ(verdict(19, true, -0.29, rules), Verdict::kTypeTwo);
  EXPECT_TRUE(is_ambiguous(19, rules));
}

TEST(LabelMap, NamesThoseThereAre) {
  for (const std::string& name : label_map_names()) EXPECT_FALSE(rules_of_label_map(name).terrain.empty()) << name;
  EXPECT_THROW(rules_of_label_map("nuscenes"), Error);
}

TEST(Score, NothingScoresNothing) {
  const Scores s = score({}, {}, {}, semantic_kitti_rules());
  EXPECT_EQ(s.with.total() + s.without.total(), 0u);
}

TEST(MeanDeviation, IsThePopulations) {
  const std::vector<double> values{2, 4, 4, 4, 5, 5, 7, 9};
  const MeanDeviation m = mean_deviation(values);
  EXPECT_DOUBLE_EQ(m.mean, 5);
  EXPECT_DOUBLE_EQ(m.deviation, 2);
  const std::vector<double> one{3.5};
  EXPECT_DOUBLE_EQ(mean_deviation(one).mean, 3.5);
  EXPECT_EQ(mean_deviation(one).deviation, 0);
  EXPECT_EQ(mean_deviation({}).mean, 0);
  EXPECT_EQ(mean_deviation({}).deviation, 0);
}

}  // namespace
}  // namespace btms
