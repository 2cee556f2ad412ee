// The oracle checked by hand: small cases whose answer is known without a program.
#include "tests/oracle/oracle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace btms::oracle {
namespace {

const long double kHalfTurn = std::acos(-1.0L);

// EXPECT_NEAR in long double.
testing::AssertionResult close(long double a, long double b, long double tolerance) {
  if (std::fabs(a - b) <= tolerance) return testing::AssertionSuccess();
  return testing::AssertionFailure() << a << " and " << b << " differ by " << a - b << ", more than " << tolerance;
}
#define EXPECT_CLOSE(a, b, tolerance) EXPECT_TRUE(close(a, b, tolerance))

// Every number written out: the hand-made answers below don't follow the defaults.
Parameters tiny(double r_m) {
  Parameters p;
  p.resolution_m = r_m;
  p.node_model = NodeModel::kPca;
  p.seed_height_m = 0.25;
  p.refit_distance_m = 0.125;
  p.slope_max_deg = 20;
  p.min_points = 3;
  p.normal_similarity = 0.03;
  p.plane_distance = 0.1;
  p.keep_nodes = 1;
  p.kernel_radius = 2;
  p.completion_normals = CompletionNormals::kPlane;
  p.min_support = 0.05;
  p.terrain_distance_m = 0.125;
  p.below_m = 2;
  return p;
}

// Twelve points around the centroid of a node, whose mean is the centroid exactly when r is a multiple of 6 mm.
template <class Height>
void add_node(std::vector<Point>& points, const NodeKeyTuple& node, std::int64_t r_mm, Height z_mm) {
  const auto [x, y] = centroid_of(node, r_mm);
  const std::int64_t cx = std::llround(x * 1000), cy = std::llround(y * 1000);
  for (const int dx : {-300, -100, 100, 300})
    for (const int dy : {-200, 0, 200})
      points.push_back({cx + dx, cy + dy, static_cast<std::int32_t>(z_mm(cx + dx, cy + dy))});
}

TEST(Oracle, TriangleRule) {
  EXPECT_EQ(locate(1500, 1000, 2000), NodeKeyTuple(0, 0, 0));
  EXPECT_EQ(locate(1000, 1500, 2000), NodeKeyTuple(0, 0, 1));
  EXPECT_EQ(locate(500, 1000, 2000), NodeKeyTuple(0, 0, 2));
  EXPECT_EQ(locate(1000, 500, 2000), NodeKeyTuple(0, 0, 3));
  EXPECT_EQ(locate(1000, 1000, 2000), NodeKeyTuple(0, 0, 0));  // u + v = u - v = 0
  EXPECT_EQ(locate(1500, 1500, 2000), NodeKeyTuple(0, 0, 0));  // u = v > 0: east
  EXPECT_EQ(locate(500, 1500, 2000), NodeKeyTuple(0, 0, 1));   // u = -v < 0: north
  EXPECT_EQ(locate(500, 500, 2000), NodeKeyTuple(0, 0, 3));    // u = v < 0: south
  EXPECT_EQ(locate(1500, 500, 2000), NodeKeyTuple(0, 0, 0));   // u = -v > 0: east
  EXPECT_EQ(locate(2000, 0, 2000), NodeKeyTuple(0, 1, 3));     // half-open
  EXPECT_EQ(locate(-1, -1, 2000), NodeKeyTuple(-1, -1, 0));
  EXPECT_EQ(locate(-2000, 999, 2000), NodeKeyTuple(0, -1, 2));
}

// The rule picks a triangle whose corners enclose the place.
TEST(Oracle, TriangleHoldsItsPoints) {
  for (std::int64_t x = -3000; x < 3000; x += 37)
    for (std::int64_t y = -3000; y < 3000; y += 41) {
      const auto corners = corners_of(locate(x, y, 2000));
      for (int i = 0; i < 3; ++i) {
        const auto [ax, ay] = corners[i];
        const auto [bx, by] = corners[(i + 1) % 3];
        EXPECT_GE((bx - ax) * (y - ay * 1000) - (by - ay) * (x - ax * 1000), 0) << x << ", " << y;
      }
    }
}

TEST(Oracle, FourteenNeighbours) {
  for (int t = 0; t < 4; ++t) {
    const NodeKeyTuple node{-5, 7, t};
    const auto neighbours = neighbours_of(node);
    EXPECT_EQ(neighbours.size(), 14u);
    EXPECT_EQ(std::set<NodeKeyTuple>(neighbours.begin(), neighbours.end()).size(), 14u);
    for (const NodeKeyTuple& n : neighbours) {
      const auto back = neighbours_of(n);
      EXPECT_EQ(std::count(back.begin(), back.end(), node), 1);
    }
  }
}

TEST(Oracle, KernelValues) {
  EXPECT_CLOSE(kernel(0, 4), 1.0, 1e-15);
  EXPECT_CLOSE(kernel(1, 4), 0.5 + 1 / (2 * kHalfTurn), 1e-15);
  EXPECT_CLOSE(kernel(2, 4), 1.0 / 6, 1e-15);
  EXPECT_CLOSE(kernel(3, 4), 1.0 / 6 - 1 / (2 * kHalfTurn), 1e-15);
  EXPECT_CLOSE(kernel(0.99L, 1), 8.66e-10, 1e-11);
  EXPECT_EQ(kernel(4, 4), 0);
  EXPECT_EQ(kernel(5, 4), 0);
  // The series and the printed form are one function, and it falls all the way.
  for (long double x = 0.951L; x < 0.99L; x += 0.003L)
    EXPECT_CLOSE(kernel(x, 1),
                 (2 + std::cos(2 * kHalfTurn * x)) * (1 - x) / 3 + std::sin(2 * kHalfTurn * x) / (2 * kHalfTurn),
                 1e-18);
  long double before = 1;
  for (long double x = 0.001L; x < 1; x += 0.001L) {
    EXPECT_GT(kernel(x, 1), 0);
    EXPECT_LT(kernel(x, 1), before);
    before = kernel(x, 1);
  }
}

TEST(Oracle, FilledFlatTriangleWeighsOneThird) {
  std::vector<Point> points;
  for (std::int64_t x = 5; x < 2000; x += 10)
    for (std::int64_t y = 5; y < 2000; y += 10) points.push_back({x, y, 700});
  const Result result = run(points, tiny(2));
  ASSERT_EQ(result.nodes.count({0, 0, 0}), 1u);
  for (int t = 0; t < 4; ++t) {
    const Node& n = result.nodes.at({0, 0, t});
    EXPECT_CLOSE(n.weight, 1.0 / 3, 0.01);
    EXPECT_CLOSE(n.l1, 1.0 / 6, 0.005);   // across: base^2 / 24
    EXPECT_CLOSE(n.l2, 1.0 / 18, 0.002);  // along: height^2 / 18
    EXPECT_CLOSE(n.l3, 0, 1e-15);
    EXPECT_CLOSE(n.normal[2], 1, 1e-15);
  }
}

// The corners of a box, half edges 0.3, 0.2, 0.1 m: eigenvalues 0.09, 0.04, 0.01; w = (8/9)(3/9).
TEST(Oracle, WeightOfABox) {
  std::vector<Point> points;
  for (const int x : {-300, 300})
    for (const int y : {-200, 200})
      for (const int z : {-100, 100}) points.push_back({2500 + x, 1500 + y, z});
  const Result result = run(points, tiny(3));
  const Node& n = result.nodes.at({0, 0, 0});
  EXPECT_CLOSE(n.l1, 0.09L, 1e-15);
  EXPECT_CLOSE(n.l2, 0.04L, 1e-15);
  EXPECT_CLOSE(n.l3, 0.01L, 1e-15);
  EXPECT_CLOSE(n.weight, 8.0L / 27, 1e-15);
}

TEST(Oracle, NoPlaneWithoutThreeIndependentPoints) {
  const auto has_plane = [](const std::vector<Point>& points, NodeModel model) {
    Parameters p = tiny(2);
    p.node_model = model;
    return run(points, p).nodes.at({0, 0, 0}).has_plane;
  };
  for (const NodeModel model : {NodeModel::kPca, NodeModel::kRobust}) {
    EXPECT_FALSE(has_plane({{1500, 900, 0}, {1500, 1100, 0}}, model));
    EXPECT_FALSE(has_plane(std::vector<Point>(20, {1500, 1000, 5}), model));
    EXPECT_FALSE(has_plane({{1500, 900, 0}, {1500, 1000, 0}, {1500, 1100, 0}, {1500, 1150, 0}}, model));
    EXPECT_FALSE(has_plane({{1500, 900, 0}, {1501, 1000, 0}, {1500, 1100, 0}, {1501, 1150, 0}}, model));  // 1 mm off
    EXPECT_TRUE(has_plane({{1400, 900, 0}, {1500, 1100, 0}, {1600, 1000, 0}}, model));
  }
}

TEST(Oracle, EqualPlaneEqualHeights) {
  for (const NodeModel model : {NodeModel::kPca, NodeModel::kRobust})
    for (const CompletionNormals normals : {CompletionNormals::kFaithful, CompletionNormals::kPlane})
      for (const std::int64_t origin : {std::int64_t{0}, std::int64_t{-7000}, std::int64_t{5'700'000'000}}) {
        Parameters p = tiny(4);
        p.node_model = model;
        p.completion_normals = normals;
        p.keep_nodes = 10;
        std::vector<Point> points;
        for (std::int64_t x = 0; x < 20000; x += 200)
          for (std::int64_t y = 0; y < 20000; y += 190)
            points.push_back({origin + x, origin + y, static_cast<std::int32_t>(100 * 1000 + x / 10 - y / 5)});
        const auto truth = [&](long double x, long double y) {
          const long double o = static_cast<long double>(origin) / 1000;
          return 100 + (x - o) / 10 - (y - o) / 5;
        };
        const Result result = run(points, p);
        int exact = 0;
        for (const auto& [corner, z] : result.corners) {
          const long double x = 2.0L * corner.first, y = 2.0L * corner.second;
          const long double o = static_cast<long double>(origin) / 1000;
          const bool inside = x > o + 4 && x < o + 16 && y > o + 4 && y < o + 16;
          if (!inside && normals == CompletionNormals::kFaithful) continue;  // predictions beyond the rim flatten
          EXPECT_CLOSE(z, truth(x, y), 1e-9);
          ++exact;
        }
        EXPECT_GT(exact, 10);
        // Above the plane by eps3 or less is terrain; the final plane is tilted, so its distances are shorter.
        for (std::size_t i = 0; i < points.size(); ++i)
          if (std::fabs(points[i].x_mm - origin - 10000) < 5000 && std::fabs(points[i].y_mm - origin - 10000) < 5000) {
            EXPECT_EQ(result.labels[i], Label::kTerrain);
            EXPECT_CLOSE(result.distances[i], 0, 1e-9);
          }
      }
}

// Eq 10 flattens slopes by construction: a hole of one node in a perfect plane, l = 2 r.
TEST(Oracle, FaithfulNormalsFlattenSlopes) {
  const auto predicted_slope = [](double degrees, CompletionNormals normals) {
    const std::int64_t r_mm = 3000;
    Parameters p = tiny(3);
    p.slope_max_deg = 60;
    p.normal_similarity = 1;
    p.plane_distance = 1.5;
    p.completion_normals = normals;
    const long double gradient = std::tan(degrees * kHalfTurn / 180);
    std::vector<Point> points;
    for (std::int64_t row = -4; row <= 4; ++row)
      for (std::int64_t col = -4; col <= 4; ++col)
        for (int t = 0; t < 4; ++t)
          if (NodeKeyTuple(row, col, t) != NodeKeyTuple(0, 0, 0))
            add_node(points, {row, col, t}, r_mm, [&](std::int64_t x, std::int64_t) {
              return std::llround(gradient * static_cast<long double>(x));
            });
    const Result result = run(points, p);
    const Node& hole = result.nodes.at({0, 0, 0});
    EXPECT_TRUE(hole.predicted);
    EXPECT_EQ(hole.count, 0);
    EXPECT_LT(hole.normal[0], 0);  // leans away from the slope, which rises with x
    return static_cast<double>(std::acos(hole.normal[2]) * 180 / kHalfTurn);
  };
  for (const auto& [slope, flattened] :
       {std::pair{5.0, 2.95}, {10.0, 5.93}, {15.0, 8.93}, {20.0, 11.99}, {30.0, 18.35}}) {
    EXPECT_CLOSE(predicted_slope(slope, CompletionNormals::kFaithful), flattened, 0.01);
    EXPECT_CLOSE(predicted_slope(slope, CompletionNormals::kPlane), slope, 0.03);  // heights in whole mm
  }
}

// One terrain node alone: Eq 8 gives its height everywhere, Eq 9 a level normal (its z difference is 0), Eq 11 w s_z.
TEST(Oracle, OneNodeFaithful) {
  Parameters p = tiny(3);
  p.completion_normals = CompletionNormals::kFaithful;
  std::vector<Point> points;
  add_node(points, {0, 0, 0}, 3000, [](std::int64_t x, std::int64_t) { return 1000 + (x - 2500) / 10; });
  const Result result = run(points, p);
  const Node& self = result.nodes.at({0, 0, 0});
  ASSERT_TRUE(self.terrain);
  EXPECT_CLOSE(self.mean[0], 2.5, 1e-15);
  EXPECT_CLOSE(self.mean[2], 1.0, 1e-15);
  EXPECT_CLOSE(self.normal[0], -0.1 / std::sqrt(1.01), 1e-12);
  const Node& next = result.nodes.at({0, 1, 2});  // the west triangle of the next square, centroid at x = 3.5
  ASSERT_TRUE(next.predicted);
  EXPECT_CLOSE(next.support, kernel(1, 6), 1e-15);
  EXPECT_CLOSE(next.mean[0], 3.5, 1e-15);
  EXPECT_CLOSE(next.mean[1], 1.5, 1e-15);
  EXPECT_CLOSE(next.mean[2], 1.0, 1e-15);
  EXPECT_CLOSE(next.normal[2], 1.0, 1e-15);
  EXPECT_CLOSE(next.weight, self.weight / std::sqrt(1.01), 1e-12);
  // The corner they share at (3, 0): 1.05 from the tilted plane, 1.0 from the level one, both sqrt(2.5) away; but the
  // other six nodes around the corner are level, too, at 1.0.
  long double sum_w = 0, sum_wz = 0;
  for (const NodeKeyTuple& key :
       {NodeKeyTuple{0, 0, 0}, {0, 0, 3}, {0, 1, 2}, {0, 1, 3}, {-1, 0, 0}, {-1, 0, 1}, {-1, 1, 1}, {-1, 1, 2}}) {
    const auto found = result.nodes.find(key);
    if (found == result.nodes.end() || !(found->second.terrain || found->second.predicted)) continue;
    const Node& n = found->second;
    const long double w = n.weight / std::hypot(3 - n.mean[0], n.mean[1]);
    sum_w += w;
    sum_wz += w * (&n == &self ? 1.05L : 1.0L);
  }
  EXPECT_CLOSE((result.corners.at({2, 0})), sum_wz / sum_w, 1e-9);
}

// One terrain node alone, plane mode: its plane goes on exactly.
TEST(Oracle, OneNodePlane) {
  const Parameters p = tiny(3);
  std::vector<Point> points;
  add_node(points, {0, 0, 0}, 3000, [](std::int64_t x, std::int64_t) { return 1000 + (x - 2500) / 10; });
  const Result result = run(points, p);
  int predicted = 0;
  for (const auto& [key, n] : result.nodes) {
    if (!n.predicted) continue;
    ++predicted;
    EXPECT_CLOSE(n.mean[2], 1 + (n.mean[0] - 2.5L) / 10, 1e-12);
    EXPECT_CLOSE(n.normal[0], -0.1 / std::sqrt(1.01), 1e-12);
    EXPECT_CLOSE(n.weight, result.nodes.at({0, 0, 0}).weight, 1e-12);
    EXPECT_GT(n.support, 0.05);
  }
  EXPECT_GT(predicted, 14);
}

// Two level nodes at the two sides of an empty one: the kernel mean of their heights.
TEST(Oracle, KernelMeanOfHeights) {
  Parameters p = tiny(3);
  std::vector<Point> points;
  add_node(points, {0, 0, 0}, 3000, [](std::int64_t, std::int64_t) { return 1000; });
  add_node(points, {0, 2, 2}, 3000, [](std::int64_t, std::int64_t) { return 1600; });
  for (const CompletionNormals normals : {CompletionNormals::kFaithful, CompletionNormals::kPlane}) {
    p.completion_normals = normals;
    const Result result = run(points, p);
    const Node& n = result.nodes.at({0, 1, 2});  // centroid 3.5; the neighbours' at 2.5 and 6.5
    const long double k1 = kernel(1, 6), k2 = kernel(3, 6);
    EXPECT_CLOSE(n.support, k1 + k2, 1e-15);
    if (normals == CompletionNormals::kFaithful) {
      EXPECT_CLOSE(n.mean[2], (k1 * 1.0L + k2 * 1.6L) / (k1 + k2), 1e-15);
      continue;
    }
    // Plane mode, one gradient g along x: minimise k1 (1 - a + g)^2 + k2 (1.6 - a - 3 g)^2 + rho (k1 + k2) g^2.
    // da: a = h - g D with h, D the kernel means of z and D; dg: g = Cov(z, D) / (Var(D) + rho).
    const long double k = k1 + k2, h = (k1 + 1.6L * k2) / k, d = (-k1 + 3 * k2) / k;
    const long double cov = (k1 * (1 - h) * (-1 - d) + k2 * (1.6L - h) * (3 - d)) / k;
    const long double var = (k1 * (-1 - d) * (-1 - d) + k2 * (3 - d) * (3 - d)) / k;
    const long double g = cov / (var + 2.25L);
    EXPECT_CLOSE(n.mean[2], h - g * d, 1e-15);
    EXPECT_CLOSE(-n.normal[0] / n.normal[2], g, 1e-15);
  }
}

TEST(Oracle, CandidatesAndComponents) {
  const std::int64_t r_mm = 3000;
  std::vector<Point> points;
  for (int t = 0; t < 4; ++t)
    for (std::int64_t col = 0; col < 2; ++col)
      add_node(points, {0, col, t}, r_mm, [](std::int64_t, std::int64_t) { return 0; });
  for (int t = 0; t < 4; ++t)  // a roof beside it: near, but 3 m up
    add_node(points, {0, 2, t}, r_mm, [](std::int64_t, std::int64_t) { return 3000; });
  const auto terrain = [&](const Parameters& p) {
    int n = 0;
    for (const auto& [key, node] : run(points, p).nodes) n += node.terrain;
    return n;
  };
  Parameters p = tiny(3);
  EXPECT_EQ(terrain(p), 12);
  p.keep_nodes = 4;
  EXPECT_EQ(terrain(p), 12);
  p.keep_nodes = 5;
  EXPECT_EQ(terrain(p), 8);
  p.keep_nodes = 9;
  EXPECT_EQ(terrain(p), 0);
  p.keep_nodes = 1;
  p.min_points = 12;
  EXPECT_EQ(terrain(p), 12);
  p.min_points = 13;
  EXPECT_EQ(terrain(p), 0);
}

// Eq 6 on two level nodes 1 m apart whose heights differ: the step passes up to |d| sin eps2.
TEST(Oracle, StepLimit) {
  const auto components = [](int step_mm) {
    Parameters p = tiny(3);
    p.keep_nodes = 2;
    std::vector<Point> points;
    add_node(points, {0, 0, 0}, 3000, [](std::int64_t, std::int64_t) { return 0; });
    add_node(points, {0, 1, 2}, 3000, [&](std::int64_t, std::int64_t) { return step_mm; });
    return run(points, p).nodes.at({0, 0, 0}).terrain;
  };
  // step <= sqrt(1 + step^2) sin 0.1: step <= tan 0.1 = 0.10033
  EXPECT_TRUE(components(100));
  EXPECT_FALSE(components(101));
  EXPECT_TRUE(components(-100));
  EXPECT_FALSE(components(-101));
}

// Eq 6 on two nodes 1 m apart that lean to opposite sides across the line between them: dot = cos 2 phi against
// 1 - sin 0.03, so 2 phi <= 14.07 degrees, tan phi <= 0.1234.
TEST(Oracle, NormalLimit) {
  const auto linked = [](int rise_mm) {  // over 200 mm
    Parameters p = tiny(3);
    p.keep_nodes = 2;
    std::vector<Point> points;
    add_node(points, {0, 0, 0}, 3000, [&](std::int64_t, std::int64_t y) { return (y - 1500) / 200 * rise_mm; });
    add_node(points, {0, 1, 2}, 3000, [&](std::int64_t, std::int64_t y) { return (1500 - y) / 200 * rise_mm; });
    return run(points, p).nodes.at({0, 0, 0}).terrain;
  };
  EXPECT_TRUE(linked(24));   // 0.120
  EXPECT_FALSE(linked(25));  // 0.125
}

// Eq 5: tan 20 degrees is 0.36397.
TEST(Oracle, SlopeLimit) {
  for (const int percent : {36, 37}) {
    std::vector<Point> points;
    add_node(points, {0, 0, 0}, 3000, [&](std::int64_t x, std::int64_t) { return x / 100 * percent; });
    const Result result = run(points, tiny(3));
    EXPECT_TRUE(result.nodes.at({0, 0, 0}).has_plane);
    EXPECT_EQ(result.nodes.at({0, 0, 0}).candidate, percent == 36);
  }
}

// Between two level nodes at different heights the predicted and the final planes get too steep at some step. Here by
// the gradient, not by the normal: g^2 > tan^2.
TEST(Oracle, PredictionsAndFinalPlanesKeepTheSlopeLimit) {
  const long double limit = std::tan(20 * kHalfTurn / 180);
  int reverted = 0, refused = 0, kept = 0, dropped = 0;
  for (const CompletionNormals normals : {CompletionNormals::kFaithful, CompletionNormals::kPlane})
    for (int step_mm = 0; step_mm < 6000; step_mm += 250) {
      Parameters p = tiny(3);
      p.completion_normals = normals;
      std::vector<Point> points;
      add_node(points, {0, 0, 0}, 3000, [](std::int64_t, std::int64_t) { return 0; });
      add_node(points, {0, 2, 2}, 3000, [&](std::int64_t, std::int64_t) { return step_mm; });
      const Result result = run(points, p);
      if (normals == CompletionNormals::kPlane) {
        const long double k1 = kernel(1, 6), k2 = kernel(3, 6), k = k1 + k2, h = step_mm * k2 / k / 1000;
        const long double d = (-k1 + 3 * k2) / k;
        const long double cov = (k1 * (0 - h) * (-1 - d) + k2 * (step_mm / 1000.0L - h) * (3 - d)) / k;
        const long double var = (k1 * (-1 - d) * (-1 - d) + k2 * (3 - d) * (3 - d)) / k;
        EXPECT_EQ(result.nodes.at({0, 1, 2}).predicted, cov / (var + 2.25L) <= limit);
        ++(result.nodes.at({0, 1, 2}).predicted ? reverted : refused);
      }
      for (const auto& [key, n] : result.nodes) {
        const auto& z = n.corner_z;
        if (std::isnan(z[0] + z[1] + z[2])) {
          EXPECT_FALSE(n.has_final);
          continue;
        }
        // From the centre corner the other two are at (+-1.5, +-1.5): half their sum and half their difference lie
        // along the axes, 1.5 m away.
        const long double along = ((z[1] + z[2]) / 2 - z[0]) / 1.5L, across = (z[2] - z[1]) / 3;
        const bool gentle = along * along + across * across <= limit * limit;
        EXPECT_EQ(n.has_final, gentle);
        ++(gentle ? kept : dropped);
      }
    }
  EXPECT_GT(std::min({reverted, refused, kept, dropped}), 3);
}

// Two level nodes around one corner: weights over distances. The first node's mean is 0.1 m off its centroid.
TEST(Oracle, CornerWeights) {
  Parameters p = tiny(3);
  p.min_support = 1000;  // no predictions
  std::vector<Point> points;
  for (const int x : {-300, -100, 100, 300})
    for (const int y : {-200, 0, 200}) points.push_back({2600 + x, 1500 + y, 1000});
  for (const int x : {-150, 150})
    for (const int y : {-100, 100}) points.push_back({4500 + x, 500 + y, 1600});  // south of the next square
  const Result result = run(points, p);
  // Variances 0.05 and 0.08 / 3; 0.0225 and 0.01.
  const long double w1 = 0.08L / 3 / 0.05L, w2 = 0.01L / 0.0225L;
  const long double d1 = std::hypot(0.4L, 1.5L), d2 = std::hypot(1.5L, 0.5L);
  EXPECT_CLOSE((result.corners.at({2, 0})), (w1 / d1 * 1.0L + w2 / d2 * 1.6L) / (w1 / d1 + w2 / d2), 1e-12);
  EXPECT_CLOSE((result.corners.at({2, 2})), 1.0L, 1e-12);
  EXPECT_CLOSE((result.corners.at({4, 0})), 1.6L, 1e-12);
  EXPECT_EQ(result.corners.size(), 5u);
  EXPECT_EQ(result.labels.front(), Label::kTerrain);
}

TEST(Oracle, SeedHeight) {
  EXPECT_EQ(seed_height_mm({5}), 5);
  EXPECT_EQ(seed_height_mm({-3, 100, 200}), -3);                // k = 0, so 1
  EXPECT_EQ(seed_height_mm({0, 31, 32, 33, 34, 35, 36}), 15);   // k = 1: bucket 0 whole, 15.5 floored
  EXPECT_EQ(seed_height_mm({-510, 0, 0, 0, 0, 0, 0, 0}), -64);  // k = 2: -510 / 8 = -63.75
  EXPECT_EQ(seed_height_mm({0, 2047, 2048, 9000, 9000, 9000, 9000, 9000}), 1023);  // k = 2, the last bucket is 63
  EXPECT_EQ(seed_height_mm({0, 2048, 2048, 9000, 9000, 9000, 9000, 9000}), 0);     // fewer than k in 64 buckets
  std::vector<std::int64_t> many;
  for (int i = 0; i < 200; ++i) many.push_back(32 * (i / 2));  // two a bucket, k = 20: ten buckets
  EXPECT_EQ(seed_height_mm(many), 32 * 9 / 2);
}

// The robust model finds the ground under a canopy and a car; the literal one doesn't.
TEST(Oracle, RobustNodeModel) {
  std::vector<Point> points;
  add_node(points, {0, 0, 0}, 3000, [](std::int64_t x, std::int64_t) { return (x - 2500) / 10; });
  add_node(points, {0, 0, 0}, 3000, [](std::int64_t x, std::int64_t) { return 1500 + x % 7 * 100; });
  Parameters p = tiny(3);
  EXPECT_FALSE(run(points, p).nodes.at({0, 0, 0}).candidate && run(points, p).nodes.at({0, 0, 0}).l3 < 1e-6);
  p.node_model = NodeModel::kRobust;
  const Result result = run(points, p);
  const Node& n = result.nodes.at({0, 0, 0});
  EXPECT_EQ(n.count, 24);
  EXPECT_CLOSE(n.mean[2], 0, 1e-12);
  EXPECT_CLOSE(n.normal[0] / n.normal[2], -0.1, 1e-12);
  EXPECT_CLOSE(n.l3, 0, 1e-15);
}

// One low outlier: 24 points at 0 and one at -500 mm. k = 25 / 4 = 6, so the seeds are the outlier (bucket 0) and all
// of the bucket that holds height 0: 500 / 32 = 15; mean -20, seed height -20; every point lies below it + 250.
TEST(Oracle, RobustSeedsTakeWholeBuckets) {
  std::vector<Point> points;
  for (const int shift : {0, 40})
    for (const int dx : {-300, -100, 100, 300})
      for (const int dy : {-200, 0, 200}) points.push_back({2500 + dx + shift, 1500 + dy, 0});
  points.push_back({2520, 1500, -500});
  Parameters p = tiny(3);
  p.node_model = NodeModel::kRobust;
  p.seed_height_m = 0.019;  // leaves the outlier alone among the seeds: below -20 + 19
  EXPECT_FALSE(run(points, p).nodes.at({0, 0, 0}).has_plane);
  p.seed_height_m = 0.020;
  const Result result = run(points, p);
  ASSERT_TRUE(result.nodes.at({0, 0, 0}).has_plane);
  EXPECT_CLOSE(result.nodes.at({0, 0, 0}).mean[2], -0.5 / 25, 1e-12);  // a refit has no lower limit: it stays in
}

TEST(Oracle, Labels) {
  std::vector<Point> points;
  for (std::int64_t row = 0; row < 3; ++row)
    for (std::int64_t col = 0; col < 3; ++col)
      for (int t = 0; t < 4; ++t)
        add_node(points, {row, col, t}, 3000, [](std::int64_t, std::int64_t) { return 1000; });
  const std::size_t ground = points.size();
  Parameters p = tiny(3);
  p.node_model = NodeModel::kRobust;
  points.push_back({4000, 4500, 1300});  // above the seeds and the refits
  points.push_back({4000, 4500, 1302});
  points.push_back({500'000, 500'000, 1000});  // nothing around
  p.terrain_distance_m = 0.301;
  Result result = run(points, p);
  for (std::size_t i = 0; i < ground; ++i) EXPECT_EQ(result.labels[i], Label::kTerrain);
  EXPECT_CLOSE(result.distances[ground], 0.3L, 1e-12);
  EXPECT_EQ(result.labels[ground], Label::kTerrain);
  EXPECT_EQ(result.labels[ground + 1], Label::kObstacle);
  EXPECT_EQ(result.labels[ground + 2], Label::kObstacle);
  EXPECT_TRUE(std::isnan(result.distances[ground + 2]));

  // A deep point spoils its own node; the neighbours fill it in.
  points.push_back({4000, 4500, -2000});
  result = run(points, p);
  EXPECT_FALSE(result.nodes.at({1, 1, 2}).terrain);
  EXPECT_TRUE(result.nodes.at({1, 1, 2}).predicted);
  EXPECT_EQ(result.labels.back(), Label::kBelow);
  for (std::size_t i = 0; i < ground; ++i) EXPECT_EQ(result.labels[i], Label::kTerrain);
}

}  // namespace
}  // namespace btms::oracle
