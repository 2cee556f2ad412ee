// Eq 6 and Eq 7-11 on small cases, and their order-independence.
#include "engine/terrain/completion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/lattice/lattice.h"
#include "engine/terrain/kernel.h"
#include "engine/terrain/local_convexity.h"
#include "engine/terrain/trigonometry.h"
#include "tests/support/cloud.h"

namespace btms::test {
namespace {

TEST(Trigonometry, MatchesTheSeriesEnds) {
  for (int i = 0; i <= 1000; ++i) {
    const double x = kPi / 2 * i / 1000;
    EXPECT_NEAR(sine(x), std::sin(x), 2e-15);
    EXPECT_NEAR(cosine(x), std::cos(x), 2e-15);
  }
}

TEST(Kernel, IsPositiveAndFallsUpToItsEnd) {
  double last = 2;
  for (int i = 0; i < 100'000; ++i) {
    const double k = kernel_real(i / 100'000.0);
    EXPECT_GT(k, 0);
    EXPECT_LT(k, last);
    last = k;
  }
  EXPECT_EQ(kernel_real(1), 0);
  EXPECT_EQ(kernel_real(7), 0);
  EXPECT_EQ(kernel(0), 1 << kKernelBits);
  EXPECT_NEAR(kernel_real(0.99), 8.7e-10, 0.1e-10);  // where the printed form has lost all its digits
}

Node plane_node(double gx, double gy, std::int32_t z, NodeClass c = NodeClass::kTerrain) {
  Node n;
  n.mean_z_mm = z;
  set_normal(n, Eigen::Vector3d{-gx, -gy, 1}.normalized());
  n.weight = 20000;
  n.node_class = c;
  return n;
}

TEST(LocalConvexity, IsSymmetricToTheBit) {
  const ConvexityRules rules(preset("partial-map"));
  Random random(21);
  int linked = 0;
  for (int i = 0; i < 100'000; ++i) {
    const auto slope = [&] { return static_cast<double>(random.between(-300, 300)) / 1000; };
    const Node a = plane_node(slope(), slope(), 0), b = plane_node(slope(), slope(), 0);
    const Eigen::Vector3d d(static_cast<double>(random.between(-3000, 3000)),
                            static_cast<double>(random.between(-3000, 3000)),
                            static_cast<double>(random.between(-300, 300)));
    const bool forth = locally_convex(a, b, d, rules), back = locally_convex(b, a, -d, rules);
    ASSERT_EQ(forth, back);
    linked += forth;
  }
  EXPECT_GT(linked, 1000);
  EXPECT_LT(linked, 99'000);
}

TEST(LocalConvexity, NodesInOnePlaneAreLinkedAStepIsNot) {
  const ConvexityRules rules(preset("partial-map"));
  const Node a = plane_node(0, 0, 0);
  EXPECT_TRUE(locally_convex(a, a, {1000, 500, 0}, rules));
  EXPECT_TRUE(locally_convex(a, a, {0, 0, 0}, rules)) << "no distance, no contradiction";
  EXPECT_FALSE(locally_convex(a, a, {1000, 500, 150}, rules)) << "sin(0.1) times 1.1 m is 0.11 m";
}

// A ring of terrain squares on a plane around an empty one; returns the predicted east node of the empty square.
Node predict_on_plane(const Parameters& p, double gx, double gy, bool reversed = false) {
  const std::int32_t r = resolution_mm(p);
  std::vector<std::pair<Node, std::pair<std::int32_t, std::int32_t>>> nodes;
  for (std::int32_t row = -4; row <= 4; ++row)
    for (std::int32_t col = -4; col <= 4; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        if (row == 0 && col == 0) continue;
        const auto x = static_cast<std::int32_t>(col * r + centroid_x3(t, r) / 3);
        const auto y = static_cast<std::int32_t>(row * r + centroid_y3(t, r) / 3);
        nodes.push_back({plane_node(gx, gy, static_cast<std::int32_t>(std::lround(gx * x + gy * y))), {x, y}});
      }
  if (reversed) std::reverse(nodes.begin(), nodes.end());
  Neighbourhood near;
  for (const auto& [node, at] : nodes) near.add(node, at.first, at.second);
  Node target;
  CompletionScratch scratch;
  predict(target, kEast, 0, 0, near, CompletionRules(p), scratch);
  return target;
}

TEST(Completion, PlaneModeIsExactOnAPlane) {
  Parameters p = preset("city");
  p.resolution_m = 2;
  p.slope_max_deg = 45;
  for (const double g : {0.0, 0.1, 0.3, 0.6}) {
    const Node n = predict_on_plane(p, g, -g / 2);
    ASSERT_EQ(n.node_class, NodeClass::kPredicted);
    EXPECT_NEAR(n.mean_z_mm, g * 2000 / 3, 1);
    EXPECT_NEAR(gradient_of(n).x(), g, 1e-3);
    EXPECT_NEAR(gradient_of(n).y(), -g / 2, 1e-3);
    EXPECT_LE(n.sd_mm, 1);
  }
}

TEST(Completion, FaithfulModeFlattensSlopesAsPrinted) {
  Parameters p = preset("partial-map");
  p.kernel_radius = 2;
  p.slope_max_deg = 45;
  const Node n = predict_on_plane(p, 0.2, 0);
  ASSERT_EQ(n.node_class, NodeClass::kPredicted);
  EXPECT_LT(gradient_of(n).x(), 0.16);
  EXPECT_GT(gradient_of(n).x(), 0.08);
}

TEST(Completion, DoesNotDependOnTheOrderOfNeighbours) {
  for (const char* name : {"city", "partial-map"}) {
    Parameters p = preset(name);
    p.slope_max_deg = 45;
    EXPECT_EQ(predict_on_plane(p, 0.123, 0.077), predict_on_plane(p, 0.123, 0.077, true));
  }
}

TEST(Completion, WithoutNeighboursNothingChanges) {
  Node target;
  target.count = 5;
  target.mean_z_mm = 42;
  target.node_class = NodeClass::kNoPlane;
  const Node before = target;
  CompletionScratch scratch;
  predict(target, kNorth, 0, 0, {}, CompletionRules(preset("city")), scratch);
  EXPECT_EQ(target, before);
}

TEST(Completion, HaloIsWhatTheKernelReaches) {
  Parameters p = preset("city");
  for (const auto& [radius, rings] :
       {std::pair{1.0, 1}, {1.16, 1}, {1.17, 2}, {2.0, 2}, {2.5, 3}, {3.0, 3}, {3.2, 4}, {10.0, 10}}) {
    p.kernel_radius = radius;
    EXPECT_EQ(CompletionRules(p).halo(), rings) << radius;
  }
}

TEST(Completion, StaysFiniteOnAbsurdNeighbours) {
  Random random(31);
  Parameters p = preset("city");
  p.resolution_m = 64;
  p.kernel_radius = 10;
  p.slope_max_deg = 89;
  for (const CompletionNormals mode : {CompletionNormals::kFaithful, CompletionNormals::kPlane}) {
    p.completion_normals = mode;
    Neighbourhood near;
    for (int i = 0; i < 2000; ++i) {
      Node n = plane_node(0, 0, static_cast<std::int32_t>(random.between(-kMaxVertical_mm, kMaxVertical_mm)));
      n.normal_x = static_cast<std::int16_t>(random.between(-32000, 32000));
      n.weight = 65535;
      near.add(n, static_cast<std::int32_t>(random.between(-640'000, 640'000)),
               static_cast<std::int32_t>(random.between(-640'000, 640'000)));
    }
    Node target;
    CompletionScratch scratch;
    predict(target, kSouth, 0, 0, near, CompletionRules(p), scratch);
    EXPECT_TRUE(normal_of(target).allFinite());
    EXPECT_LE(std::abs(target.mean_z_mm), kMaxVertical_mm);
  }
}

}  // namespace
}  // namespace btms::test
