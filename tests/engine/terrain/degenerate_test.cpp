// The places where the method's equations are not defined or lose their digits, and what stands guard there: of both
// methods. Points in one place and on a line, bare of the kernel, and thin nodes of the fixed method: node_model_test;
// the kernel near its end and order: completion_test; planes through corners: lattice_test.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <ostream>
#include <string>
#include <vector>

#include "engine/lattice/neighbours.h"
#include "engine/terrain/completion.h"
#include "engine/terrain/corner_fit.h"
#include "engine/terrain/level_complete.h"
#include "engine/terrain/level_corners.h"
#include "engine/terrain/level_edges.h"
#include "engine/terrain/level_links.h"
#include "engine/terrain/local_convexity.h"
#include "engine/terrain/node_model.h"
#include "engine/terrain/symmetric_eigen.h"
#include "tests/support/cloud.h"
#include "tests/support/node_cloud.h"

#pragma GCC diagnostic ignored "-Wpsabi"  // lanes are inlined

namespace btms::test {
namespace {

// Clouds that leave their plane open.
struct Cloud {
  const char* name;
  bool determines_plane;
  std::function<void(NodeCloud&)> fill;
};
void PrintTo(const Cloud& cloud, std::ostream* out) { *out << cloud.name; }
const std::vector<Cloud>& clouds() {
  static const std::vector<Cloud> all = {
      {"OnePoint", false, [](NodeCloud& c) { c.add(300, 20, 5); }},
      {"TwoPoints", false, [](NodeCloud& c) { c.add(300, 20, 5), c.add(400, -20, 9); }},
      {"OnePlace", false,
       [](NodeCloud& c) {
         for (int i = 0; i < 20; ++i) c.add(700, 20, 5);
       }},
      {"TwoPlaces", false,
       [](NodeCloud& c) {
         for (int i = 0; i < 20; ++i) c.add(700 + i % 2, 20, 5);
       }},
      {"FlatLine", false,
       [](NodeCloud& c) {
         for (int i = 0; i < 40; ++i) c.add(20 * i, 0, 5);
       }},
      {"DiagonalLine", false,
       [](NodeCloud& c) {
         for (int i = 0; i < 40; ++i) c.add(20 * i, 10 * i, 5 + 2 * i);
       }},
      {"UprightLine", false,
       [](NodeCloud& c) {
         for (int i = 0; i < 40; ++i) c.add(500, 100, 5 + 9 * i);
       }},
      {"LongUprightLine", false,
       [](NodeCloud& c) {
         for (int i = 0; i < 40; ++i) c.add(500, 100, 5 + 250'000 * i);
       }},
      {"NearlyALine", false,
       [](NodeCloud& c) {
         for (int i = 0; i < 40; ++i) c.add(20 * i, 10 * i + i % 2, 5);
       }},
      {"UprightPlane", true,
       [](NodeCloud& c) {
         for (int i = 0; i < 400; ++i) c.add(500, 20 * (i % 20) - 200, 5 + 30 * (i / 20));
       }},
      {"SmallestPlane", true,
       [](NodeCloud& c) {
         for (int i = 0; i < 25; ++i) c.add(500 + 2 * (i % 5), 2 * (i / 5), 5);
       }},
      {"FlatPlane", true,
       [](NodeCloud& c) {
         for (int i = 0; i < 400; ++i) c.add(40 * (i % 20), 9 * (i / 20), 5);
       }},
  };
  return all;
}

class Degenerate : public testing::TestWithParam<Cloud> {
 protected:
  NodeCloud cloud_;
  void SetUp() override { GetParam().fill(cloud_); }
};
INSTANTIATE_TEST_SUITE_P(Clouds, Degenerate, testing::ValuesIn(clouds()),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST_P(Degenerate, FixedNodesHaveAPlaneOnlyWhereThereIsOne) {
  for (const NodeModel model : {NodeModel::kPca, NodeModel::kRobust})
    for (const NodeWeight weight : {NodeWeight::kNormalized, NodeWeight::kPredecessor}) {
      Parameters p = preset("paper-partial-map");
      p.node_model = model;
      p.node_weight = weight;
      p.min_points = 1;
      p.slope_max_deg = 89;
      FourPoints four;
      four[2] = cloud_.points();
      std::array<Node, 4> nodes;
      ModelScratch scratch;
      model_four(four, NodeModelRules(p), scratch, nodes.data());
      const Node& n = nodes[2];
      EXPECT_EQ(n.count, cloud_.x.size());
      if (!GetParam().determines_plane) {
        EXPECT_EQ(n.node_class, NodeClass::kNoPlane);
        EXPECT_EQ(n.weight, 0);
        EXPECT_GE(n.mean_z_mm, 5) << "the lowest points stay known";
        EXPECT_LE(n.mean_z_mm, 100);
      } else if (n.node_class == NodeClass::kCandidate) {
        if (weight == NodeWeight::kNormalized) {
          EXPECT_GT(n.weight, 0);
        }
        EXPECT_NEAR(normal_of(n).norm(), 1, 1e-9);
      }
    }
}

// A level's ridge takes the place of the guard: what the points leave open is the prior's.
TEST_P(Degenerate, LevelNodesTakeFromThePriorWhatPointsLeaveOpen) {
  for (const double ridge : {1e-4, 0.05, 100.0})  // from end to end of the parameter's range
    for (const double quantile : {0.0, 0.02, 1.0})
      for (const bool first : {false, true}) {
        Parameters p = preset("city");
        p.ridge = ridge;
        p.first_quantile = quantile;
        GatedPoints gated;
        const PriorPlane prior{0, 0.01, -0.02, 50};
        const LevelRules rules(p, 2000, first, false);
        LevelNode n = fit_level_node(cloud_.points(), kEast, prior, rules, gated);
        EXPECT_EQ(n.count, cloud_.x.size());
        EXPECT_LE(std::abs(n.mean_x_mm), 1000);
        EXPECT_LE(std::hypot(n.slope_x, n.slope_y), (p.slope_limit + 1e-3) * kSlopeUnit);
        if (n.level_class != LevelClass::kEmpty) {
          EXPECT_GT(n.weight, 0);
        }
        const std::string name = GetParam().name;
        if (name.ends_with("Point") || name == "OnePlace") {
          EXPECT_EQ(n.slope_x, first ? 0 : stored_slope(0.01)) << "ridge " << ridge;
          EXPECT_EQ(n.slope_y, first ? 0 : stored_slope(-0.02)) << "ridge " << ridge;
        }
        classify(n, prior, rules);
        EXPECT_NE(n.level_class, LevelClass::kOutside);
      }
}

struct EigenCase {
  const char* name;
  double xx, xy, xz, yy, yz, zz;
};
TEST(EigenDegenerate, ALittleBelowZeroIsZero) {
  // What rounding leaves of a plane's smallest eigenvalue: not below zero, and no weight beyond 1 from it.
  for (const EigenCase& c :
       {EigenCase{"flat", 1e6, 0, 0, 1e6, 0, -1e-9}, EigenCase{"long", 1e6, 0, 0, 10, 0, -1e-9},
        EigenCase{"small", 2, 1, 0, 2, 0, -1e-15}, EigenCase{"huge", 1e12, 3e11, 0, 1e12, 0, -1e-4}}) {
    SCOPED_TRACE(c.name);
    const EigenSystems e =
        solve_eigen({Lanes{} + c.xx, Lanes{} + c.xy, Lanes{} + c.xz, Lanes{} + c.yy, Lanes{} + c.yz, Lanes{} + c.zz});
    EXPECT_GE(e.l3[1], 0);
    EXPECT_LE(e.l3[1], 1e-9 * e.l1[1]);
    EXPECT_LE((1 - e.l3[1] / e.l1[1]) * ((e.l2[1] - e.l3[1]) / e.l1[1]), 1 + 1e-12);
    EXPECT_NEAR(e.normal_z[1], 1, 1e-9);
  }
}

Node tilted(double gx, double gy, std::int32_t z_mm, std::uint16_t weight = 20'000) {
  Node n;
  n.mean_z_mm = z_mm;
  set_normal(n, Eigen::Vector3d{-gx, -gy, 1}.normalized());
  n.weight = weight;
  n.node_class = NodeClass::kTerrain;
  return n;
}

TEST(LinkDegenerate, MeansInOnePlaceAreLinkedWhenTheirNormalsAgree) {
  const ConvexityRules rules(preset("paper-partial-map"));
  EXPECT_TRUE(locally_convex(tilted(0.1, 0, 0), tilted(0.1, 0, 0), {0, 0, 0}, rules));
  EXPECT_FALSE(locally_convex(tilted(0.1, 0, 0), tilted(0.2, 0, 0), {0, 0, 0}, rules));
  // Of the levels: no distance to bend over.
  const LevelRules level(preset("city"), 2000, false, true);
  LevelNode a, b;
  a.mean_x_mm = 1000, b.mean_x_mm = -1000;  // both on the border of their squares
  EXPECT_TRUE(compare(a, b, 2000, 0, level).linked);
  b.mean_z_mm = 5000;
  EXPECT_FALSE(compare(a, b, 2000, 0, level).linked);
  EXPECT_EQ(compare(a, b, 2000, 0, level).step, -1);
}

TEST(LinkDegenerate, TheSineOfALongDistanceStaysAtItsTop) {
  // eps1 = 0.03 per m: pi/2 at 52 m, pi at 105 m, where a bare sine would part equal normals.
  const ConvexityRules rules(preset("paper-partial-map"));
  for (const double metres : {52.0, 53.0, 104.0, 106.0, 157.0, 200.0, 1e6})
    EXPECT_TRUE(locally_convex(tilted(0, 0, 0), tilted(0, 0, 0), {metres * 1000, 0, 0}, rules)) << metres;
  // Normals 45 degrees apart: cos = 0.71 asks for a sine of 0.29, and more distance never parts them again.
  ConvexityRules normals_only = rules;
  normals_only.sine_plane_distance = 1;
  EXPECT_FALSE(locally_convex(tilted(0, 1, 0), tilted(0, 0, 0), {5'000, 0, 0}, normals_only));
  for (const double metres : {15.0, 60.0, 110.0, 150.0})
    EXPECT_TRUE(locally_convex(tilted(0, 1, 0), tilted(0, 0, 0), {metres * 1000, 0, 0}, normals_only)) << metres;
}

// Predictions of the east node of an empty square of 6 m, whose centroid is (2000, 0).
Parameters six_metres(CompletionNormals normals) {
  Parameters p = preset("paper-partial-map");
  p.completion_normals = normals;
  p.resolution_m = 6;
  p.kernel_radius = 1;
  p.slope_max_deg = 89;
  return p;
}
Node predict_east(const std::vector<Neighbour>& near, const Parameters& p) {
  std::array<Node, kTriangles> square;
  CompletionScratch scratch;
  std::vector<std::uint32_t> all(near.size());
  std::iota(all.begin(), all.end(), 0u);
  predict_square(square.data(), 0, 0, near, all, CompletionRules(p), scratch);
  return square[kEast];
}

TEST(CompletionDegenerate, ANeighbourInThePlaceLendsItsOwnNormal) {
  const Node from = tilted(0.2, -0.1, 700);
  for (const CompletionNormals mode : {CompletionNormals::kFaithful, CompletionNormals::kPlane}) {
    const Node n = predict_east({neighbour_of(from, 2000, 0)}, six_metres(mode));
    ASSERT_EQ(n.node_class, NodeClass::kPredicted);
    EXPECT_EQ(n.mean_z_mm, 700);
    EXPECT_NEAR(n.normal_x, from.normal_x, 4);
    EXPECT_NEAR(n.normal_y, from.normal_y, 4);
  }
}

TEST(CompletionDegenerate, ProposedNormalsThatCancelPredictNothing) {
  // Saddles: across each neighbour the proposals are opposite. Higher than any map allows they leave no upward part.
  for (const double height : {1e3, 1e6, 1e8, 1e9}) {
    std::vector<Neighbour> near;
    for (const auto& [x, y, z] :
         {std::array{1.0, 0.0, height}, {-1.0, 0.0, height}, {0.0, 1.0, -height}, {0.0, -1.0, -height}}) {
      near.push_back(neighbour_of(tilted(0, 0, 0), static_cast<std::int32_t>(2000 + x), static_cast<std::int32_t>(y)));
      near.back().z_mm = z;
    }
    const Node n = predict_east(near, six_metres(CompletionNormals::kFaithful));
    if (height > 2e7) {
      EXPECT_EQ(n.node_class, NodeClass::kEmpty) << height;
    } else {
      EXPECT_EQ(n.normal_x, 0) << height;
      EXPECT_EQ(n.normal_y, 0) << height;
    }
  }
}

TEST(CompletionDegenerate, AWeightBelowZeroIsNone) {
  // The neighbours' means rise to the east steeply, their own planes to the west: s_i . s_j < 0.
  std::vector<Neighbour> near;
  for (const int x : {-2000, 2000})
    near.push_back(neighbour_of(tilted(-3, 0, 0), 2000 + x, 0)), near.back().z_mm = 2.0 * x;
  const Node n = predict_east(near, six_metres(CompletionNormals::kFaithful));
  EXPECT_GT(n.support, 0);
  EXPECT_EQ(n.node_class, NodeClass::kEmpty);
  EXPECT_EQ(n.weight, 0);
}

TEST(CompletionDegenerate, AtTheEndOfTheKernelNothingIsLeft) {
  // d/l = 0.99: within reach, and k rounds to zero.
  const std::vector<Neighbour> near = {neighbour_of(tilted(0, 0, 300), 2000 + 5940, 0)};
  for (const CompletionNormals mode : {CompletionNormals::kFaithful, CompletionNormals::kPlane})
    EXPECT_EQ(predict_east(near, six_metres(mode)), Node{});

  const std::array<bool, kTriangles> wanted{true, false, false, false};
  for (const bool first : {false, true}) {
    Parameters p = preset("city");
    p.level_kernel_radius = 1;
    const LevelRules rules(p, 6000, first, false);
    LevelNeighbourhood around;
    LevelNode far[kTriangles];
    far[kEast].level_class = LevelClass::kNear;
    far[kEast].weight = 40'000;
    far[kEast].mean_z_mm = 300;
    // On the first level the radius doubles twice.
    around.choose(around.add(far, 2000 + (first ? 4 : 1) * 5940, 0));
    SquarePriors priors;
    priors[kEast] = {1234, 0, 0, 77, 2};
    std::array<LevelNode, kTriangles> nodes;
    LevelCompletionScratch scratch;
    complete_level_square(nodes.data(), wanted, 0, 0, around, priors, rules, scratch);
    if (first) {
      EXPECT_EQ(nodes[kEast].level_class, LevelClass::kOutside);
    } else {
      EXPECT_EQ(nodes[kEast].mean_z_mm, 1234);
      EXPECT_EQ(nodes[kEast].source, 2);
      EXPECT_GT(nodes[kEast].weight, 0);
    }
  }
}

TEST(CompletionDegenerate, NearTheEndOfTheKernelHeightsStayBetweenTheNeighbours) {
  // Three neighbours at d/l in [0.9, 1), where the printed form's sign is noise and heights fly off by 100 m.
  Random random(3);
  const Parameters p = [] {
    Parameters q = six_metres(CompletionNormals::kFaithful);
    q.min_support = 0;
    return q;
  }();
  int predicted = 0;
  for (int round = 0; round < 20'000; ++round) {
    std::vector<Neighbour> near;
    std::int32_t low = INT32_MAX, high = INT32_MIN;
    for (int i = 0; i < 3; ++i) {
      const double t = static_cast<double>(random.between(9000, 9999)) / 10'000,
                   turn = static_cast<double>(random.between(0, 628)) / 100;
      const auto z = static_cast<std::int32_t>(random.between(-1000, 1000));
      low = std::min(low, z), high = std::max(high, z);
      near.push_back(neighbour_of(tilted(0, 0, z), static_cast<std::int32_t>(2000 + 6000 * t * std::cos(turn)),
                                  static_cast<std::int32_t>(6000 * t * std::sin(turn))));
    }
    const Node n = predict_east(near, p);
    if (n.node_class != NodeClass::kPredicted) continue;
    ++predicted;
    ASSERT_GE(n.mean_z_mm, low);
    ASSERT_LE(n.mean_z_mm, high);
  }
  EXPECT_GT(predicted, 100);
}

TEST(CornerDegenerate, AMeanAtTheCornerDecidesAndStaysFinite) {
  CornerMean at;
  Node here = tilted(0.3, 0, 500);
  here.mean_x_mm = 1000, here.mean_y_mm = 1000;
  at.add(CornerPlane(here), 1000, 1000);
  EXPECT_EQ(at.height_mm(), 500);
  at.add(CornerPlane(tilted(0, 0, 900)), 1000, 1000);  // 1.4 m away, counts as little as a thousandth
  EXPECT_EQ(at.height_mm(), 500);

  // Of the levels: distances are floored at a share of r.
  const LevelRules rules(preset("city"), 2000, false, true);
  std::vector<LevelNode> south(2 * kTriangles), north(2 * kTriangles);
  LevelNode& n = south[kNorth];
  n.level_class = LevelClass::kNear;
  n.mean_x_mm = n.mean_y_mm = 1000;
  n.mean_z_mm = 500;
  n.weight = 1;
  PlaneRow below, above;
  below.assign(south);
  above.assign(north);
  std::array<LevelCorner, 1> corner, centre;
  CornerRules(rules).corners(below, above, corner);
  EXPECT_EQ(corner[0].z_mm, 500);
  EXPECT_EQ(corner[0].disagreement_mm, 0);
  CornerRules(rules).corners(above, above, corner);
  EXPECT_EQ(corner[0].z_mm, kUnknownHeight_mm) << "no node, no height";
  CornerRules(rules).centres(above, centre);
  EXPECT_EQ(centre[0].z_mm, kUnknownHeight_mm);
}

TEST(CornerDegenerate, WithoutWeightsThePlainMean) {
  CornerMean mean;
  EXPECT_EQ(mean.height_mm(), kUnknownHeight_mm) << "no terrain node";
  for (const std::int32_t z : {100, 200, 600}) mean.add(CornerPlane(tilted(0, 0, z, 0)), 1000, -1000);
  EXPECT_EQ(mean.height_mm(), 300);
}

// Planes of levels always weigh something, so there all weights are 0 only where there is no plane.
TEST(CornerDegenerate, LevelNodesWeighSomething) {
  Parameters p = preset("city");
  p.completed_weight = 0;
  p.least_weight = 0.0001;  // the ends of their ranges
  const LevelRules rules(p, 2000, false, true);
  LevelNode node;
  take_prior(node, kEast, {}, rules);
  EXPECT_GT(node.weight, 0);
}

TEST(FinalPlaneDegenerate, HeightsAreAboveThePlaneWhicheverWayItsCornersRun) {
  // The printed distance takes the cross product of unit vectors, whose length is not 1 and whose sign follows the
  // order of the corners; heights over the plane have neither.
  for (std::uint8_t t = 0; t < kTriangles; ++t)
    for (const std::array<std::int32_t, 3>& corners : {std::array<std::int32_t, 3>{0, 0, 0},
                                                       {100, -100, 100},
                                                       {kMaxVertical_mm, -kMaxVertical_mm, kMaxVertical_mm}}) {
      const FinalPlane plane = FinalPlane::through(t, corners);
      EXPECT_EQ(plane.centre_mm, corners[0]) << int{t};
      EXPECT_GE(plane.rise2_mm2(), 0) << int{t};
      const std::array<std::int32_t, 3> raised{corners[0] + 1, corners[1] + 1, corners[2] + 1};
      EXPECT_EQ(FinalPlane::through(t, raised).centre_mm - plane.centre_mm, 1) << "up is up";
      EXPECT_EQ(FinalPlane::through(t, raised).rise2_mm2(), plane.rise2_mm2());
    }
}

}  // namespace
}  // namespace btms::test
