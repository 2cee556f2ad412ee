// What is worked out four nodes at a time is what comes out one by one.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "engine/lattice/neighbours.h"
#include "engine/terrain/kernel.h"
#include "engine/terrain/level_complete.h"
#include "engine/terrain/level_corners.h"
#include "engine/terrain/level_edges.h"
#include "engine/terrain/level_links.h"
#include "engine/terrain/parameters.h"
#include "tests/support/cloud.h"

namespace btms::test {
namespace {

const LevelRules kLast(preset("city"), 2000, false, true), kCoarsest(preset("city"), 32000, true, false);

LevelNode random_node(Random& random, std::int32_t r_mm, std::int32_t relief_mm) {
  LevelNode n;
  n.mean_x_mm = static_cast<std::int16_t>(random.between(-r_mm / 2, r_mm / 2));
  n.mean_y_mm = static_cast<std::int16_t>(random.between(-r_mm / 2, r_mm / 2));
  n.mean_z_mm = static_cast<std::int32_t>(random.between(-relief_mm, relief_mm));
  n.slope_x = static_cast<std::int16_t>(random.between(-6000, 6000));
  n.slope_y = static_cast<std::int16_t>(random.between(-6000, 6000));
  n.weight = static_cast<std::uint16_t>(random.between(0, 65535));
  n.sd_mm = static_cast<std::uint16_t>(random.between(0, 500));
  n.level_class = static_cast<LevelClass>(random.between(0, 6));
  if (random.between(0, 2) > 0) n.level_class = LevelClass::kNear;
  return n;
}
std::vector<LevelNode> random_row(Random& random, std::size_t squares, std::int32_t r_mm, std::int32_t relief_mm) {
  std::vector<LevelNode> row;
  for (std::size_t i = 0; i < squares * kTriangles; ++i) row.push_back(random_node(random, r_mm, relief_mm));
  return row;
}

TEST(LevelEdges, AreWhatComparisonsOfTwoNodesSay) {
  Random random(3);
  NodeRow here, north;  // used again for shorter rows, too
  int linked = 0, above = 0, below = 0;
  for (const std::size_t squares : {61u, 3u, 38u, 36u, 57u}) {
    const auto a = random_row(random, squares + 2, 2000, 600), b = random_row(random, squares + 2, 2000, 600);
    std::vector<ForwardEdges> edges(squares * kTriangles);
    here.assign(a);
    north.assign(b);
    EdgeRules(kLast).compare(here, north, edges);
    for (std::size_t i = 0; i < squares; ++i)
      for (std::size_t t = 0; t < kTriangles; ++t)
        for (int k = 0; k < kForwardTable[t].count; ++k) {
          const NodeOffset& o = kForwardTable[t].offset[static_cast<std::size_t>(k)];
          const LevelNode& from = a[(i + 1) * kTriangles + t];
          const LevelNode& to =
              (o.row > 0 ? b : a)[(i + 1 + static_cast<std::size_t>(o.col)) * kTriangles + o.triangle];
          LevelEdge expected;
          if (from.has_plane() && to.has_plane()) expected = compare(from, to, o.col * 2000, o.row * 2000, kLast);
          const ForwardEdges& found = edges[i * kTriangles + t];
          ASSERT_EQ(found.linked >> k & 1, expected.linked ? 1 : 0);
          ASSERT_EQ((found.above >> k & 1) - (found.below >> k & 1), expected.step);
          linked += expected.linked, above += expected.step > 0, below += expected.step < 0;
        }
  }
  EXPECT_GT(std::min({linked, above, below}), 50);
}

// Completion of one node in integers.
LevelNode complete_slowly(LevelNode node, std::uint8_t t, const std::vector<LevelNode>& near,
                          const std::vector<Cell>& places, const PriorPlane& given, const LevelRules& rules) {
  const LevelParameters& q = rules.p();
  const std::int32_t r = rules.r_mm();
  const PriorPlane prior = rules.first() ? PriorPlane{} : given;
  const double x = static_cast<double>(centroid_x3(t, r)) / 3, y = static_cast<double>(centroid_y3(t, r)) / 3;
  const double p = prior.at(x, y);
  const auto datum = static_cast<std::int64_t>(round_half_up(p));
  std::vector<std::array<std::int64_t, 2>> terms;
  std::int64_t sum = 0, weighted = 0;
  for (int doubling = 0; doubling < (rules.first() ? 3 : 1); ++doubling) {
    const double radius = round_half_up(q.level_kernel_radius * r) * (1 << doubling);
    terms.clear();
    sum = weighted = 0;
    for (std::size_t i = 0; i < near.size(); ++i) {
      if (!near[i].has_plane()) continue;
      const Cell& c = places[i / kTriangles];
      const std::int64_t dx3 = 3 * (std::int64_t{c.col} * r + near[i].mean_x_mm) - centroid_x3(t, r);
      const std::int64_t dy3 = 3 * (std::int64_t{c.row} * r + near[i].mean_y_mm) - centroid_y3(t, r);
      const std::int64_t d9 = dx3 * dx3 + dy3 * dy3;
      if (static_cast<double>(d9) >= 9 * radius * radius) continue;
      const std::int64_t k = (kernel(std::sqrt(static_cast<double>(d9)) / (3 * radius)) * near[i].weight) >> 16;
      const double lean = -(near[i].slope_x / kSlopeUnit * static_cast<double>(dx3) +
                            near[i].slope_y / kSlopeUnit * static_cast<double>(dy3)) /
                          3;
      const std::int64_t z = near[i].mean_z_mm - datum +
                             static_cast<std::int64_t>(round_half_up((rules.first() ? q.first_tilt : q.tilt) * lean));
      terms.push_back({k, z});
      sum += k;
      weighted += k * z;
    }
    if (static_cast<double>(sum) > (rules.first() ? 1e-3 * kKernelUnit : 0.0)) break;
  }
  if (sum == 0) {
    if (rules.first())
      node.level_class = LevelClass::kOutside;
    else
      take_prior(node, t, given, rules);
    return node;
  }
  const auto s = static_cast<double>(sum), w = static_cast<double>(weighted);
  const auto middle = static_cast<std::int64_t>(round_half_up(w / s));
  std::int64_t squares = 0, coarse = 0;
  for (const auto& [k, z] : terms) {
    const std::int64_t e = std::clamp<std::int64_t>(z - middle, -(1 << 14), 1 << 14), k12 = (k + (1 << 11)) >> 12;
    squares += k12 * e * e;
    coarse += k12;
  }
  take_prior(node, t, prior, rules);  // for the place
  node.mean_z_mm =
      height_mm(p + (static_cast<double>(datum) - p) + w / (s + (rules.first() ? 0 : q.shrink * kKernelUnit)));
  node.source = 0;
  const double support = s / kKernelUnit;
  node.weight = saturate_u16((q.completed_weight * support / (support + 1) + q.least_weight) * kWeightUnit);
  node.sd_mm = saturate_u16(coarse > 0 ? std::sqrt(static_cast<double>(squares) / static_cast<double>(coarse)) : 0);
  return node;
}

TEST(LevelCompletion, IsThatOfOneNodeInIntegers) {
  Random random(4);
  LevelNeighbourhood near;
  LevelCompletionScratch scratch;
  int prior_taken = 0, outside = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const LevelRules& rules = trial % 2 ? kCoarsest : kLast;
    const std::int32_t relief = trial % 5 == 0 ? kMaxVertical_mm : 20'000, reach = trial % 3 == 0 ? 9 : 4;
    std::vector<LevelNode> nodes;
    std::vector<Cell> places;
    near.clear();
    for (std::int64_t n = random.between(0, 12); n > 0; --n) {
      const Cell c{static_cast<std::int32_t>(random.between(-reach, reach)),
                   static_cast<std::int32_t>(random.between(-reach, reach))};
      const auto square = random_row(random, 1, rules.r_mm(), relief);
      near.choose(near.add(square.data(), c.col * rules.r_mm(), c.row * rules.r_mm()));
      nodes.insert(nodes.end(), square.begin(), square.end());
      places.push_back(c);
    }
    SquarePriors priors;
    std::array<bool, kTriangles> wanted;
    std::array<LevelNode, kTriangles> found, expected;
    for (std::uint8_t t = 0; t < kTriangles; ++t) {
      priors[t] = {static_cast<double>(random.between(-relief, relief)) / 4, 0.25, -0.5, 120, 1};
      wanted[t] = random.between(0, 3) > 0;
      found[t] = expected[t] = random_node(random, rules.r_mm(), relief);
      if (wanted[t]) expected[t] = complete_slowly(expected[t], t, nodes, places, priors[t], rules);
      prior_taken += wanted[t] && expected[t].source == 1;
      outside += wanted[t] && rules.first() && expected[t].level_class == LevelClass::kOutside;
    }
    complete_level_square(found.data(), wanted, 0, 0, near, priors, rules, scratch);
    for (std::uint8_t t = 0; t < kTriangles; ++t)
      ASSERT_EQ(std::memcmp(&found[t], &expected[t], sizeof(LevelNode)), 0) << trial << " " << int{t};
  }
  EXPECT_GT(prior_taken, 20);
  EXPECT_GT(outside, 20);
}

// A corner plane by plane.
LevelCorner corner_slowly(const std::vector<std::array<double, 2>>& from, const std::vector<LevelNode>& planes,
                          double floor_mm) {
  double z = 0, sd = 0, weight = 0, squares = 0;
  std::vector<std::array<double, 2>> seen;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const LevelNode& n = planes[i];
    if (n.level_class == LevelClass::kOutside) continue;
    const double x = -(from[i][0] + n.mean_x_mm), y = -(from[i][1] + n.mean_y_mm);
    const double w = n.weight / std::max(floor_mm, std::sqrt(x * x + y * y));
    seen.push_back({w, n.mean_z_mm + (n.slope_x * x + n.slope_y * y) / kSlopeUnit});
    z += w * seen.back()[1];
    sd += w * n.sd_mm;
    weight += w;
  }
  if (!(weight > 0)) return {};
  for (const auto& [w, height] : seen) squares += w * w * (height - z / weight) * (height - z / weight);
  return {height_mm(z / weight), saturate_u16(sd / weight), saturate_u16(std::sqrt(squares) / weight)};
}
void expect_same(const LevelCorner& a, const LevelCorner& b) {
  EXPECT_EQ(a.z_mm, b.z_mm);
  EXPECT_EQ(a.sd_mm, b.sd_mm);
  EXPECT_EQ(a.disagreement_mm, b.disagreement_mm);
}

TEST(LevelCorners, AreWhatPlaneByPlaneGives) {
  Random random(5);
  PlaneRow south, north;
  const double floor_mm = std::max(1.0, kLast.p().corner_floor_per_r * 2000);
  for (const std::size_t squares : {9u, 2u, 5u, 8u}) {
    auto a = random_row(random, squares + 2, 2000, 20'000), b = random_row(random, squares + 2, 2000, 20'000);
    for (std::size_t i = 0; i < 8; ++i) a[i].level_class = b[i].level_class = LevelClass::kOutside;
    south.assign(a);
    north.assign(b);
    std::vector<LevelCorner> corners(squares + 1), centres(squares);
    CornerRules(kLast).corners(south, north, corners);
    CornerRules(kLast).centres(north, centres);
    EXPECT_EQ(corners[0].z_mm, kUnknownHeight_mm);
    for (std::size_t i = 0; i <= squares; ++i) {
      std::vector<std::array<double, 2>> from;
      std::vector<LevelNode> planes;
      for (const NodeOffset& o : kIncidentTable) {
        from.push_back({o.col * 2000.0 + 1000, o.row * 2000.0 + 1000});
        planes.push_back((o.row < 0 ? a : b)[(i + static_cast<std::size_t>(o.col + 1)) * kTriangles + o.triangle]);
      }
      expect_same(corners[i], corner_slowly(from, planes, floor_mm));
      if (i == squares) continue;
      const auto* own = &b[(i + 1) * kTriangles];
      expect_same(centres[i], corner_slowly({{0, 0}, {0, 0}, {0, 0}, {0, 0}}, {own, own + kTriangles}, floor_mm));
    }
  }
}

}  // namespace
}  // namespace btms::test
