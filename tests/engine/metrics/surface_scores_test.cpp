#include "engine/metrics/surface_scores.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace btms {
namespace {

SurfaceSample of(double z_m, double truth_m, double sd_m = 1, NodeState state = NodeState::kObserved) {
  return surface_sample(state, z_m, sd_m, truth_m, 0, false);
}

TEST(SurfaceScores, OfATableWorkedByHand) {
  std::vector<SurfaceSample> samples{of(10.3, 10), of(9.6, 10), of(10, 10), of(12, 10, 1, NodeState::kFilled),
                                     of(99, 10, 1, NodeState::kUnknown)};
  const SurfaceScores s = score_surface(samples);
  EXPECT_EQ(s.places, 5u);
  EXPECT_EQ(s.known, 4u);
  EXPECT_EQ(s.filled, 1u);
  EXPECT_NEAR(s.rmse_m, std::sqrt((0.09 + 0.16 + 0 + 4) / 4), 1e-6);
  EXPECT_NEAR(s.mae_m, 2.7 / 4, 1e-6);
  EXPECT_NEAR(s.bias_m, 1.9 / 4, 1e-6);
  EXPECT_NEAR(s.p95_m, 2, 1e-6);
  EXPECT_DOUBLE_EQ(s.within, 0.75);  // 2 m is beyond 1.96 m
  EXPECT_DOUBLE_EQ(s.complete(), 0.8);
  EXPECT_DOUBLE_EQ(s.inferred(), 0.6);
}

TEST(SurfaceScores, The95PercentIntervalIsClosed) {
  EXPECT_TRUE(of(0.196, 0, 0.1).within);
  EXPECT_TRUE(of(-0.195, 0, 0.1).within);
  EXPECT_FALSE(of(0.1961, 0, 0.1).within);
  EXPECT_FALSE(of(0.001, 0, 0).within);
  EXPECT_TRUE(of(0, 0, 0).within);
}

TEST(SurfaceScores, P95IsTheRankAboveNineteenTwentieths) {
  std::vector<SurfaceSample> samples;
  for (int k = 1; k <= 100; ++k) samples.push_back(of(k % 2 == 0 ? k : -k, 0));
  EXPECT_DOUBLE_EQ(score_surface(samples).p95_m, 95);
  samples.push_back(of(101, 0));  // ceil(0.95 * 101) = 96
  EXPECT_DOUBLE_EQ(score_surface(samples).p95_m, 96);
  EXPECT_DOUBLE_EQ(score_surface({of(-3, 0)}).p95_m, 3);
}

TEST(SurfaceScores, DoNotDependOnTheOrder) {
  std::vector<SurfaceSample> samples;
  for (int k = 0; k < 1000; ++k) samples.push_back(of(1e-5 * k * k * (k % 3 - 1), 0, 0.01 * (k % 7)));
  const SurfaceScores forwards = score_surface(samples);
  std::reverse(samples.begin(), samples.end());
  const SurfaceScores backwards = score_surface(samples);
  EXPECT_EQ(forwards.rmse_m, backwards.rmse_m);
  EXPECT_EQ(forwards.mae_m, backwards.mae_m);
  EXPECT_EQ(forwards.bias_m, backwards.bias_m);
  EXPECT_EQ(forwards.p95_m, backwards.p95_m);
  EXPECT_EQ(forwards.within, backwards.within);
}

TEST(SurfaceScores, AGroupIsScoredAlone) {
  std::vector<SurfaceSample> samples{of(1, 0), of(5, 0)};
  samples[1].group = 3;
  const SurfaceScores s = score_surface(samples, [](const SurfaceSample& p) { return p.group == 3; });
  EXPECT_EQ(s.places, 1u);
  EXPECT_DOUBLE_EQ(s.mae_m, 5);
}

TEST(SurfaceScores, NothingScoresNothing) {
  const SurfaceScores none = score_surface({});
  EXPECT_EQ(none.places + none.known + none.filled, 0u);
  EXPECT_EQ(none.rmse_m + none.p95_m + none.within + none.complete() + none.inferred(), 0);
  const SurfaceScores unknown = score_surface({of(1, 0, 1, NodeState::kUnknown)});
  EXPECT_EQ(unknown.places, 1u);
  EXPECT_EQ(unknown.known, 0u);
  EXPECT_EQ(unknown.rmse_m, 0);
}

TEST(SurfaceScores, AbsurdHeightsSaturate) {
  const SurfaceScores s = score_surface({of(1e9, 0), of(-1e9, 0)});
  EXPECT_DOUBLE_EQ(s.mae_m, 2000);
  EXPECT_DOUBLE_EQ(s.bias_m, 0);
  EXPECT_DOUBLE_EQ(s.rmse_m, 2000);
}

}  // namespace
}  // namespace btms
