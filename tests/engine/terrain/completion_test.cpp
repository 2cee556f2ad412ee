// Eq 6 and Eq 7-11 on small cases, and their order-independence.
#include "engine/terrain/completion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

#include "engine/lattice/lattice.h"
#include "engine/terrain/kernel.h"
#include "engine/terrain/local_convexity.h"
#include "engine/trigonometry.h"
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
  const ConvexityRules rules(preset("paper-partial-map"));
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
  const ConvexityRules rules(preset("paper-partial-map"));
  const Node a = plane_node(0, 0, 0);
  EXPECT_TRUE(locally_convex(a, a, {1000, 500, 0}, rules));
  EXPECT_TRUE(locally_convex(a, a, {0, 0, 0}, rules)) << "no distance, no contradiction";
  EXPECT_FALSE(locally_convex(a, a, {1000, 500, 150}, rules)) << "sin(0.1) times 1.1 m is 0.11 m";
}

std::array<Node, kTriangles> predict_empty_square(std::span<const Neighbour> near, const Parameters& p) {
  std::array<Node, kTriangles> square;
  CompletionScratch scratch;
  std::vector<std::uint32_t> all(near.size());
  std::iota(all.begin(), all.end(), 0u);
  predict_square(square.data(), 0, 0, near, all, CompletionRules(p), scratch);
  return square;
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
  std::vector<Neighbour> near;
  for (const auto& [node, at] : nodes) near.push_back(neighbour_of(node, at.first, at.second));
  return predict_empty_square(near, p)[kEast];
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
  Parameters p = preset("paper-partial-map");
  p.kernel_radius = 2;
  p.slope_max_deg = 45;
  const Node n = predict_on_plane(p, 0.2, 0);
  ASSERT_EQ(n.node_class, NodeClass::kPredicted);
  EXPECT_LT(gradient_of(n).x(), 0.16);
  EXPECT_GT(gradient_of(n).x(), 0.08);
}

TEST(Completion, DoesNotDependOnTheOrderOfNeighbours) {
  for (const char* name : {"city", "paper-partial-map"}) {
    Parameters p = preset(name);
    p.slope_max_deg = 45;
    EXPECT_EQ(predict_on_plane(p, 0.123, 0.077), predict_on_plane(p, 0.123, 0.077, true));
  }
}

TEST(Completion, WithoutNeighboursNothingChanges) {
  std::array<Node, kTriangles> square;
  square[kNorth].count = 5;
  square[kNorth].mean_z_mm = 42;
  square[kNorth].node_class = NodeClass::kNoPlane;
  const auto before = square;
  CompletionScratch scratch;
  const CompletionRules rules(preset("city"));
  predict_square(square.data(), 0, 0, {}, {}, rules, scratch);
  EXPECT_EQ(square, before);
  // The nearest mean lies beyond the kernel, though within reach of the square's centre.
  const Neighbour far = neighbour_of(plane_node(0, 0, 0), static_cast<std::int32_t>(rules.radius_mm) + 670, 0);
  constexpr std::uint32_t kOnly = 0;
  predict_square(square.data(), 0, 0, {&far, 1}, {&kOnly, 1}, rules, scratch);
  EXPECT_EQ(square, before);
}

TEST(Completion, HaloIsWhatTheKernelReaches) {
  Parameters p = preset("city");
  for (const auto& [radius, rings] :
       {std::pair{1.0, 1}, {1.16, 1}, {1.17, 2}, {2.0, 2}, {2.5, 3}, {3.0, 3}, {3.2, 4}, {10.0, 10}}) {
    p.kernel_radius = radius;
    EXPECT_EQ(CompletionRules(p).halo(), rings) << radius;
  }
}

// One node's prediction, longhand: Eq 7-11 with 63-bit sums, a neighbour at a time.
struct Longhand {
  std::int64_t support = 0;
  double z_mm = 0;
  Eigen::Vector3d normal;
  double sd_mm = 0, weight = 0;
};
Longhand predict_longhand(std::span<const Neighbour> near, std::uint8_t t, const CompletionRules& rules) {
  struct Term {
    std::int64_t k, coarse, x, y, z;
    const Neighbour* n;
  };
  const std::int64_t x3 = centroid_x3(t, rules.resolution_mm), y3 = centroid_y3(t, rules.resolution_mm);
  const std::int64_t x = floor_div(x3 + 1, 3), y = floor_div(y3 + 1, 3);
  std::vector<Term> terms;
  Longhand out;
  std::int64_t sum_z = 0, wx = 0, wy = 0, wz = 0;
  for (const Neighbour& n : near) {
    const auto nx = static_cast<std::int64_t>(n.x_mm), ny = static_cast<std::int64_t>(n.y_mm);
    const auto nz = static_cast<std::int64_t>(n.z_mm);
    const std::int64_t d9 = (3 * nx - x3) * (3 * nx - x3) + (3 * ny - y3) * (3 * ny - y3);
    if (d9 >= rules.reach9_mm2) continue;
    const std::int64_t k = kernel(std::sqrt(static_cast<double>(d9)) * rules.per_third_mm);
    const int shift = kKernelBits - rules.moment_bits;
    terms.push_back({k, (k + (1 << (shift - 1))) >> shift, nx, ny, nz, &n});
    out.support += k;
    sum_z += k * nz;
    const std::int64_t kw = (k * static_cast<std::int64_t>(n.weight)) >> 16;
    wx += kw * static_cast<std::int64_t>(n.normal_x);
    wy += kw * static_cast<std::int64_t>(n.normal_y);
    wz += kw * static_cast<std::int64_t>(n.normal_z);
  }
  if (out.support == 0) return out;
  const auto z =
      static_cast<std::int64_t>(round_half_up(static_cast<double>(sum_z) / static_cast<double>(out.support)));
  std::int64_t n = 0, s[10] = {};
  for (const Term& i : terms) {
    const std::int64_t dx = i.x - x, dy = i.y - y, dz = std::clamp<std::int64_t>(i.z - z, -(1 << 18), 1 << 18);
    const auto gx = static_cast<std::int64_t>(i.n->slope_x), gy = static_cast<std::int64_t>(i.n->slope_y);
    const std::int64_t terms_of[10] = {dx, dy, dz, dx * dx, dx * dy, dy * dy, dx * dz, dy * dz, gx, gy};
    for (int k = 0; k < 10; ++k) s[k] += i.coarse * terms_of[k];
    n += i.coarse;
  }
  if (rules.normals == CompletionNormals::kPlane) {
    const auto w = static_cast<double>(n);
    double m[10];
    for (int k = 0; k < 10; ++k) m[k] = static_cast<double>(s[k]) / w;
    const double ridge = rules.ridge_mm2;
    const double cxx = m[3] - m[0] * m[0] + ridge, cxy = m[4] - m[0] * m[1], cyy = m[5] - m[1] * m[1] + ridge;
    const double cxz = m[6] - m[0] * m[2] + ridge * (static_cast<double>(s[8]) / 4096 / w);
    const double cyz = m[7] - m[1] * m[2] + ridge * (static_cast<double>(s[9]) / 4096 / w);
    const double det = cxx * cyy - cxy * cxy;
    const double gx = (cxz * cyy - cyz * cxy) / det, gy = (cyz * cxx - cxz * cxy) / det;
    const double length = std::sqrt(1 + gx * gx + gy * gy);
    out.normal = {-gx / length, -gy / length, 1 / length};
    out.z_mm = static_cast<double>(z) + m[2] - gx * m[0] - gy * m[1];
  } else {
    std::int64_t sum[3] = {};
    for (const Term& i : terms) {
      const auto dx = static_cast<double>(x - i.x), dy = static_cast<double>(y - i.y),
                 dz = static_cast<double>(z - i.z), flat2 = dx * dx + dy * dy;
      const double scale = (1 << 24) / std::sqrt(flat2 * (flat2 + dz * dz));
      const double u[3] = {-dx * dz * scale, -dy * dz * scale, flat2 * scale};
      for (int k = 0; k < 3; ++k) sum[k] += i.k * static_cast<std::int64_t>(round_half_up(u[k]));
    }
    const double v[3] = {static_cast<double>(sum[0]), static_cast<double>(sum[1]), static_cast<double>(sum[2])};
    out.normal = Eigen::Vector3d(v[0], v[1], v[2]) / std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    out.z_mm = static_cast<double>(z);
  }
  const double gx = -out.normal.x() / out.normal.z(), gy = -out.normal.y() / out.normal.z();
  std::int64_t squares = 0;
  for (const Term& i : terms) {
    const double expected = out.z_mm + gx * static_cast<double>(i.x - x) + gy * static_cast<double>(i.y - y);
    if (i.coarse == 0) continue;  // of a neighbourhood without any, `expected` is not a number
    const auto e =
        static_cast<std::int64_t>(std::clamp(round_half_up(static_cast<double>(i.z) - expected), -16384.0, 16384.0));
    squares += i.coarse * e * e;
  }
  out.sd_mm = std::sqrt(static_cast<double>(squares) / static_cast<double>(n));
  out.weight = (static_cast<double>(wx) * out.normal.x() + static_cast<double>(wy) * out.normal.y() +
                static_cast<double>(wz) * out.normal.z()) /
               kNormalUnit / static_cast<double>(out.support) * kWeightUnit;
  return out;
}

TEST(Completion, LanesAndWideSumsAgreeWithLonghandToTheBit) {
  // From low ground, where sums fit doubles, to relief for which they need 63 bits.
  Random random(41);
  int predicted = 0;
  for (const CompletionNormals mode : {CompletionNormals::kFaithful, CompletionNormals::kPlane})
    for (const double resolution : {0.5, 2.0, 4.0, 31.0})
      for (const std::int32_t relief : {20, 4000, 60'000, 3'000'000})
        for (const int size : {1, 2, 3, 5, 30, 203}) {
          Parameters p = preset("city");
          p.completion_normals = mode;
          p.resolution_m = resolution;
          p.slope_max_deg = 89;
          const CompletionRules rules(p);
          const auto reach = static_cast<std::int64_t>(rules.radius_mm);
          std::vector<Neighbour> near;
          for (int i = 0; i < size; ++i) {
            const auto slope = [&] { return static_cast<double>(random.between(-300, 300)) / 1000; };
            Node n = plane_node(slope(), slope(), static_cast<std::int32_t>(512'000 + random.between(-relief, relief)));
            n.weight = static_cast<std::uint16_t>(random.between(1, 65535));
            near.push_back(neighbour_of(n, static_cast<std::int32_t>(random.between(-reach, reach)),
                                        static_cast<std::int32_t>(random.between(-reach, reach))));
          }
          const auto square = predict_empty_square(near, p);
          for (std::uint8_t t = 0; t < kTriangles; ++t) {
            const Longhand truth = predict_longhand(near, t, rules);
            ASSERT_EQ(square[t].support, saturate_u16(static_cast<double>(truth.support >> 16)));
            if (square[t].node_class != NodeClass::kPredicted) continue;
            ++predicted;
            Node expected = square[t];
            set_normal(expected, truth.normal);
            expected.mean_z_mm = height_mm(truth.z_mm);
            expected.sd_mm = saturate_u16(truth.sd_mm);
            expected.weight = saturate_u16(truth.weight);
            ASSERT_EQ(square[t], expected) << resolution << ' ' << relief << ' ' << size;
          }
        }
  EXPECT_GT(predicted, 300);
}

TEST(Completion, StaysFiniteOnAbsurdNeighbours) {
  Random random(31);
  Parameters p = preset("city");
  p.resolution_m = 64;
  p.kernel_radius = 10;
  p.slope_max_deg = 89;
  for (const CompletionNormals mode : {CompletionNormals::kFaithful, CompletionNormals::kPlane}) {
    p.completion_normals = mode;
    std::vector<Neighbour> near;
    for (int i = 0; i < 2000; ++i) {
      Node n = plane_node(0, 0, static_cast<std::int32_t>(random.between(-kMaxVertical_mm, kMaxVertical_mm)));
      n.normal_x = static_cast<std::int16_t>(random.between(-32000, 32000));
      n.weight = 65535;
      near.push_back(neighbour_of(n, static_cast<std::int32_t>(random.between(-640'000, 640'000)),
                                  static_cast<std::int32_t>(random.between(-640'000, 640'000))));
    }
    for (const Node& target : predict_empty_square(near, p)) {
      EXPECT_TRUE(normal_of(target).allFinite());
      EXPECT_LE(std::abs(target.mean_z_mm), kMaxVertical_mm);
    }
  }
}

}  // namespace
}  // namespace btms::test
