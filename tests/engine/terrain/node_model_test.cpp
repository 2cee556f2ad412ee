// Eq 2, 3, 5 and the places where they are not defined.
#include "engine/terrain/node_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/terrain/model_nodes.h"
#include "engine/terrain/symmetric_eigen.h"
#include "tests/support/cloud.h"

#pragma GCC diagnostic ignored "-Wpsabi"  // lanes are inlined

namespace btms::test {
namespace {

struct NodeCloud {
  std::vector<std::int16_t> x, y;
  std::vector<std::int32_t> z;
  void add(int px, int py, int pz) {
    x.push_back(static_cast<std::int16_t>(px));
    y.push_back(static_cast<std::int16_t>(py));
    z.push_back(pz);
  }
  NodePoints points() const { return {x.data(), y.data(), z.data(), x.size()}; }
};

Parameters with(NodeModel model, int min_points = 3) {
  Parameters p = preset("paper-partial-map");
  p.node_model = model;
  p.min_points = min_points;
  return p;
}

// The points in one of the four lanes, the others empty.
Node model_node(const NodePoints& points, const NodeModelRules& rules, std::size_t lane = 0) {
  FourPoints square;
  square[lane] = points;
  std::array<Node, 4> nodes;
  ModelScratch scratch;
  model_four(square, rules, scratch, nodes.data());
  for (std::size_t t = 0; t < 4; ++t) {
    if (t != lane) {
      EXPECT_EQ(nodes[t], Node{});
    }
  }
  return nodes[lane];
}

// Sums of a node's points, one at a time.
struct Sums {
  std::int64_t n = 0, x = 0, y = 0, z = 0, xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  void add(std::int64_t px, std::int64_t py, std::int64_t pz) {
    n += 1, x += px, y += py, z += pz;
    xx += px * px, xy += px * py, xz += px * pz, yy += py * py, yz += py * pz, zz += pz * pz;
  }
  double central(std::int64_t ab, std::int64_t a, std::int64_t b) const {
    return static_cast<double>(static_cast<__int128>(n) * ab - static_cast<__int128>(a) * b);
  }
  friend bool operator==(const Sums&, const Sums&) = default;
};

struct Matrix {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
};
Matrix covariance(const Sums& m) {
  const double n = static_cast<double>(m.n), scale = 1 / (n * n);
  return {m.central(m.xx, m.x, m.x) * scale, m.central(m.xy, m.x, m.y) * scale, m.central(m.xz, m.x, m.z) * scale,
          m.central(m.yy, m.y, m.y) * scale, m.central(m.yz, m.y, m.z) * scale, m.central(m.zz, m.z, m.z) * scale};
}

struct EigenSystem {
  double l1, l2, l3;
  Eigen::Vector3d normal;
};
// In any lane; the others hold matrices that take more or fewer steps.
EigenSystem solve_eigen(const Matrix& m, std::size_t lane = 0) {
  SymmetricMatrices all{Lanes{1, 2, 3, 4}, Lanes{}, Lanes{0.5, 0, 0, 0}, Lanes{1, 2, 3, 0}, Lanes{}, Lanes{1, 1, 0, 0}};
  all.xx[lane] = m.xx, all.xy[lane] = m.xy, all.xz[lane] = m.xz;
  all.yy[lane] = m.yy, all.yz[lane] = m.yz, all.zz[lane] = m.zz;
  const EigenSystems e = btms::solve_eigen(all);
  return {e.l1[lane], e.l2[lane], e.l3[lane], {e.normal_x[lane], e.normal_y[lane], e.normal_z[lane]}};
}

// The robust model longhand: a point at a time, a bucket at a time. Returns the points the plane is made of.
Sums chosen_longhand(const NodePoints& p, const NodeModelRules& rules, std::int32_t& datum_mm) {
  const std::int64_t lowest = *std::min_element(p.z_mm, p.z_mm + p.size);
  std::array<std::int64_t, 64> count{}, sum{};
  for (std::size_t i = 0; i < p.size; ++i)
    if (const std::int64_t above = p.z_mm[i] - lowest; above < 64 * 32) ++count[above / 32], sum[above / 32] += above;
  const std::int64_t wanted = std::clamp<std::int64_t>(static_cast<std::int64_t>(p.size / 4), 1, 20);
  std::int64_t n = 0, total = 0;
  for (std::size_t k = 0; k < 64 && n < wanted; ++k) n += count[k], total += sum[k];
  datum_mm = static_cast<std::int32_t>(lowest + total / n);

  const auto select = [&](std::int64_t a, std::int64_t b, std::int64_t c, std::int64_t above_mm) {
    Sums m;
    for (std::size_t i = 0; i < p.size; ++i) {
      const std::int64_t x = p.x_mm[i], y = p.y_mm[i];
      const std::int64_t z = std::clamp<std::int64_t>(std::int64_t{p.z_mm[i]} - datum_mm, -(1 << 18), 1 << 18);
      if ((z << 12) - (a * x + b * y) <= c + (above_mm << 12)) m.add(x, y, z);
    }
    return m;
  };
  if (rules.model == NodeModel::kPca) return select(0, 0, 0, 1 << 18);
  Sums m = select(0, 0, 0, rules.seed_height_mm);
  for (int i = 0; i < 3; ++i) {
    const double cxx = m.central(m.xx, m.x, m.x), cxy = m.central(m.xy, m.x, m.y), cyy = m.central(m.yy, m.y, m.y);
    const double cxz = m.central(m.xz, m.x, m.z), cyz = m.central(m.yz, m.y, m.z), det = cxx * cyy - cxy * cxy;
    if (m.n < 3 || !(det > 1e-6 * cxx * cyy)) return {};
    const double a = std::clamp((cxz * cyy - cyz * cxy) / det, -7.9, 7.9);
    const double b = std::clamp((cyz * cxx - cxz * cxy) / det, -7.9, 7.9);
    const double c = (static_cast<double>(m.z) - a * static_cast<double>(m.x) - b * static_cast<double>(m.y)) /
                     static_cast<double>(m.n);
    const auto fixed = [](double v) { return static_cast<std::int64_t>(round_half_up(v * 4096)); };
    m = select(fixed(a), fixed(b), fixed(c), rules.refit_distance_mm);
  }
  return m;
}

// The node of the longhand choice.
Node model_longhand(const NodePoints& p, const NodeModelRules& rules) {
  Node node;
  if (p.size == 0) return node;
  node.node_class = NodeClass::kNoPlane;
  node.count = static_cast<std::uint32_t>(p.size);
  const Sums m = chosen_longhand(p, rules, node.mean_z_mm);
  if (p.size < 3 || m.n < 3) return node;
  const EigenSystem e = solve_eigen(covariance(m));
  if (e.l1 < 1e-6 || e.l2 <= 1) return node;
  const double n = static_cast<double>(m.n);
  node.mean_x_mm = static_cast<std::int16_t>(round_half_up(static_cast<double>(m.x) / n));
  node.mean_y_mm = static_cast<std::int16_t>(round_half_up(static_cast<double>(m.y) / n));
  node.mean_z_mm += static_cast<std::int32_t>(round_half_up(static_cast<double>(m.z) / n));
  set_normal(node, e.normal);
  node.weight = saturate_u16((1 - e.l3 / e.l1) * ((e.l2 - e.l3) / e.l1) * kWeightUnit);
  node.sd_mm = saturate_u16(std::sqrt(e.l3));
  if (node.count >= rules.min_points && normal_xy_squared(node) <= rules.steepest_normal_xy2)
    node.node_class = NodeClass::kCandidate;
  return node;
}

// Jacobi rotations in a fixed order: slow, simple, accurate.
std::array<double, 3> jacobi_eigenvalues(const Matrix& m) {
  double a[3][3] = {{m.xx, m.xy, m.xz}, {m.xy, m.yy, m.yz}, {m.xz, m.yz, m.zz}};
  for (int sweep = 0; sweep < 60; ++sweep)
    for (const auto& [p, q] : {std::pair{0, 1}, {0, 2}, {1, 2}}) {
      if (a[p][q] == 0) continue;
      const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
      const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
      const double c = 1 / std::sqrt(t * t + 1), s = t * c;
      for (int k = 0; k < 3; ++k) {
        const double kp = a[k][p], kq = a[k][q];
        a[k][p] = c * kp - s * kq;
        a[k][q] = s * kp + c * kq;
      }
      for (int k = 0; k < 3; ++k) {
        const double pk = a[p][k], qk = a[q][k];
        a[p][k] = c * pk - s * qk;
        a[q][k] = s * pk + c * qk;
      }
    }
  std::array<double, 3> l = {a[0][0], a[1][1], a[2][2]};
  std::sort(l.rbegin(), l.rend());
  return l;
}

TEST(SymmetricEigen, AgreesWithJacobi) {
  Random random(7);
  for (int round = 0; round < 20000; ++round) {
    // Clouds from needles to balls.
    const std::int64_t sx = random.between(1, 3000), sy = random.between(1, 3000), sz = random.between(0, 800);
    Sums m;
    for (int i = 0; i < 12; ++i) {
      const std::int64_t x = random.between(-sx, sx), y = random.between(-sy, sy);
      m.add(x, y, random.between(-sz, sz) + x / 3);
    }
    const Matrix c = covariance(m);
    const EigenSystem e = solve_eigen(c, static_cast<std::size_t>(round % 4));
    const auto truth = jacobi_eigenvalues(c);
    ASSERT_NEAR(e.l1, truth[0], 1e-9 * truth[0]);
    ASSERT_NEAR(e.l2, truth[1], 1e-9 * truth[0]);
    ASSERT_NEAR(e.l3, truth[2], 1e-9 * truth[0]);
    // The normal is the eigenvector of l3 wherever l3 stands apart.
    if (truth[1] - truth[2] < 1e-3 * truth[0]) continue;
    const Eigen::Vector3d n = e.normal;
    const Eigen::Vector3d cn{c.xx * n.x() + c.xy * n.y() + c.xz * n.z(), c.xy * n.x() + c.yy * n.y() + c.yz * n.z(),
                             c.xz * n.x() + c.yz * n.y() + c.zz * n.z()};
    ASSERT_LT((cn - truth[2] * n).norm(), 1e-9 * truth[0]);
    ASSERT_NEAR(n.norm(), 1, 1e-12);
    ASSERT_GE(n.z(), 0);
  }
}

TEST(SymmetricEigen, KnowsCoincidingRootsToHalfTheDigits) {
  // Four-fold symmetric discs, needles with a round section, balls: two or three eigenvalues coincide.
  Random random(8);
  for (int round = 0; round < 20000; ++round) {
    const double a = static_cast<double>(random.between(1, 1000)), b = static_cast<double>(random.between(0, 1000));
    const double tiny = static_cast<double>(random.between(-9, 9)) * 1e-9;
    // Rotated by a random unit quaternion.
    double q[4], length = 0;
    for (double& v : q) v = static_cast<double>(random.between(-1000, 1000)), length += v * v;
    if (length == 0) continue;
    for (double& v : q) v /= std::sqrt(length);
    const double R[3][3] = {
        {1 - 2 * (q[2] * q[2] + q[3] * q[3]), 2 * (q[1] * q[2] - q[0] * q[3]), 2 * (q[1] * q[3] + q[0] * q[2])},
        {2 * (q[1] * q[2] + q[0] * q[3]), 1 - 2 * (q[1] * q[1] + q[3] * q[3]), 2 * (q[2] * q[3] - q[0] * q[1])},
        {2 * (q[1] * q[3] - q[0] * q[2]), 2 * (q[2] * q[3] + q[0] * q[1]), 1 - 2 * (q[1] * q[1] + q[2] * q[2])}};
    const double l[3] = {a, a * (1 + tiny), b};
    double m[3][3] = {};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        for (int k = 0; k < 3; ++k) m[i][j] += R[i][k] * l[k] * R[j][k];
    const Matrix c{m[0][0], m[0][1], m[0][2], m[1][1], m[1][2], m[2][2]};
    const EigenSystem e = solve_eigen(c);
    const auto truth = jacobi_eigenvalues(c);
    const double tolerance = (std::abs(a - b) > 0.1 * a ? 1e-6 : 1e-4) * truth[0];
    ASSERT_NEAR(e.l1, truth[0], tolerance) << a << ' ' << b;
    ASSERT_NEAR(e.l2, truth[1], tolerance) << a << ' ' << b;
    ASSERT_NEAR(e.l3, truth[2], tolerance) << a << ' ' << b;
  }
}

TEST(SymmetricEigen, IsTotal) {
  const double not_a_number = std::nan("");
  for (const Matrix& m : {Matrix{}, Matrix{1, 0, 0, 1, 0, 1}, Matrix{1, 0, 0, 0, 0, 0}, Matrix{1e-300, 0, 0, 0, 0, 0},
                          Matrix{1, 1, 1, 1, 1, 1}, Matrix{not_a_number, 0, 0, not_a_number, 0, 0}}) {
    const EigenSystem e = solve_eigen(m);
    EXPECT_TRUE(std::isfinite(e.l1) && std::isfinite(e.l2) && std::isfinite(e.l3) && e.normal.allFinite());
    EXPECT_GE(e.l3, 0);
  }
}

TEST(NodeModel, APlaneIsItsPlane) {
  for (const NodeModel model : {NodeModel::kPca, NodeModel::kRobust}) {
    NodeCloud c;
    for (int x = -900; x <= 900; x += 100)
      for (int y = -900; y <= 900; y += 100) c.add(x, y, 5000 + x / 5 - y / 10);
    const Node n = model_node(c.points(), NodeModelRules(with(model)));
    ASSERT_EQ(n.node_class, NodeClass::kCandidate);
    EXPECT_EQ(n.mean_z_mm, 5000);
    EXPECT_NEAR(gradient_of(n).x(), 0.2, 2e-3);
    EXPECT_NEAR(gradient_of(n).y(), -0.1, 2e-3);
  }
}

TEST(NodeModel, RobustLooksUnderWhatStandsOnTheGround) {
  NodeCloud c;
  Random random(3);
  for (int i = 0; i < 40; ++i)
    c.add(static_cast<int>(random.between(-900, 900)), static_cast<int>(random.between(-900, 900)),
          static_cast<int>(1000 + random.between(-20, 20)));
  for (int i = 0; i < 200; ++i)
    c.add(static_cast<int>(random.between(-900, 900)), static_cast<int>(random.between(-900, 900)),
          static_cast<int>(random.between(1400, 9000)));
  EXPECT_NEAR(model_node(c.points(), NodeModelRules(with(NodeModel::kRobust))).mean_z_mm, 1000, 15);
  EXPECT_GT(model_node(c.points(), NodeModelRules(with(NodeModel::kPca))).mean_z_mm, 3000);
}

TEST(NodeModel, AFullFlatTriangleWeighsOneThird) {
  // East lane of a 2 m square, evenly filled: l2/l1 = 1/3.
  NodeCloud c;
  for (int x = 5; x < 1000; x += 10)
    for (int y = -x + 5; y < x; y += 10) c.add(x, y, 0);
  const Node n = model_node(c.points(), NodeModelRules(with(NodeModel::kPca)));
  EXPECT_NEAR(n.weight / kWeightUnit, 1.0 / 3, 0.01);
}

TEST(NodeModel, DoesNotDependOnOrder) {
  Random random(11);
  for (int round = 0; round < 300; ++round) {
    NodeCloud c;
    const std::int64_t n = random.between(3, 60);
    for (std::int64_t i = 0; i < n; ++i)
      c.add(static_cast<int>(random.between(-1000, 999)), static_cast<int>(random.between(-1000, 999)),
            static_cast<int>(random.between(-500, 3000)));
    for (const NodeModel model : {NodeModel::kPca, NodeModel::kRobust}) {
      const NodeModelRules rules(with(model));
      const Node before = model_node(c.points(), rules);
      NodeCloud back = c;
      std::reverse(back.x.begin(), back.x.end());
      std::reverse(back.y.begin(), back.y.end());
      std::reverse(back.z.begin(), back.z.end());
      EXPECT_EQ(model_node(back.points(), rules, static_cast<std::size_t>(round % 4)), before);
    }
  }
}

TEST(NodeModel, LanesAgreeWithLonghandToTheBit) {
  // Four nodes of very different sizes side by side: ground, slopes, clutter, strays, steep sheets of points.
  Random random(13);
  int candidates = 0;
  for (int round = 0; round < 2000; ++round) {
    const int half = round % 2 == 0 ? 1000 : 32767;
    std::array<NodeCloud, 4> clouds;
    FourPoints square;
    for (std::size_t t = 0; t < 4; ++t) {
      const std::int64_t n = (random.between(1, 8) == 1) ? random.between(0, 4) : random.between(0, 90);
      const auto rise = random.between(-8000, 8000) / ((random.between(1, 3) == 1) ? 1 : 20);
      const std::int64_t noise = (random.between(1, 2) == 1) ? 30 : 3000;
      for (std::int64_t i = 0; i < n; ++i) {
        const auto x = static_cast<int>(random.between(-half, half - 1)),
                   y = static_cast<int>(random.between(-half, half - 1));
        auto z = 400'000 + x * rise / 1000 + random.between(-noise, noise);
        if ((random.between(1, 20) == 1)) z += random.between(-300'000, 300'000);
        clouds[t].add(x, y, static_cast<int>(z));
      }
      square[t] = clouds[t].points();
    }
    for (const NodeModel model : {NodeModel::kPca, NodeModel::kRobust}) {
      const NodeModelRules rules(with(model));
      std::array<Node, 4> nodes;
      ModelScratch scratch;
      model_four(square, rules, scratch, nodes.data());
      for (std::size_t t = 0; t < 4; ++t) {
        ASSERT_EQ(nodes[t], model_longhand(square[t], rules)) << round << ' ' << t;
        candidates += nodes[t].node_class == NodeClass::kCandidate;
      }
    }
  }
  EXPECT_GT(candidates, 1000);
}

TEST(ModelNodes, TakesEveryNodeWithPointsOnce) {
  Random random(19);
  std::vector<NodeCloud> clouds(1000);
  for (NodeCloud& c : clouds) {
    std::int64_t n = random.between(-20, 40);
    if (n == 40) n = random.between(41, 3000);
    for (std::int64_t i = 0; i < n; ++i)
      c.add(static_cast<int>(random.between(-900, 900)), static_cast<int>(random.between(-900, 900)),
            static_cast<int>(random.between(-40, 40)));
  }
  const NodeModelRules rules(with(NodeModel::kRobust));
  ModelNodesScratch scratch;
  for (const std::size_t nodes : {std::size_t{1000}, std::size_t{1}, std::size_t{0}, std::size_t{998}}) {
    std::vector<Node> found(nodes);
    std::vector<int> times(nodes, 0);
    model_nodes(
        nodes, [&](std::size_t k) { return clouds[k].points(); }, rules, scratch,
        [&](std::size_t k, const Node& node) { found[k] = node, ++times[k]; });
    for (std::size_t k = 0; k < nodes; ++k) {
      ASSERT_EQ(times[k], clouds[k].x.empty() ? 0 : 1);
      ASSERT_EQ(found[k], model_node(clouds[k].points(), rules));
    }
  }
  for (std::size_t n = 1; n < 100'000; ++n) {
    ASSERT_GE(size_class(n), size_class(n - 1));
    ASSERT_LE(size_class(n), size_class(n - 1) + 1);
  }
  EXPECT_LT(size_class(SIZE_MAX), kSizeClasses);
}

TEST(NodeModelDegenerate, NoPointsFewPointsOnePlace) {
  for (const NodeModel model : {NodeModel::kPca, NodeModel::kRobust}) {
    const NodeModelRules rules(with(model, 1));
    EXPECT_EQ(model_node({}, rules).node_class, NodeClass::kEmpty);
    NodeCloud c;
    for (int i = 0; i < 2; ++i) {
      c.add(10 * i, 0, 7);
      EXPECT_EQ(model_node(c.points(), rules).node_class, NodeClass::kNoPlane);
    }
    NodeCloud same;  // 20 times the same point
    for (int i = 0; i < 20; ++i) same.add(123, -456, 789);
    const Node n = model_node(same.points(), rules);
    EXPECT_EQ(n.node_class, NodeClass::kNoPlane);
    EXPECT_EQ(n.weight, 0);
    EXPECT_EQ(n.mean_z_mm, 789);
    EXPECT_EQ(n.count, 20u);
  }
}

TEST(NodeModelDegenerate, PointsOnALineHaveNoPlane) {
  const NodeModelRules rules(with(NodeModel::kPca, 1));
  NodeCloud flat, upright, slanted;
  for (int i = -300; i <= 300; i += 7) {
    flat.add(i, i, 0);
    upright.add(5, 5, i);
    slanted.add(i, static_cast<int>(std::floor(0.77 * i + 0.5)), static_cast<int>(std::floor(0.13 * i + 0.5)));
  }
  for (const NodeCloud& c : {flat, upright, slanted})
    EXPECT_EQ(model_node(c.points(), rules).node_class, NodeClass::kNoPlane);
}

TEST(NodeModelDegenerate, SteepPlanesAndThinNodesAreNoCandidates) {
  NodeCloud steep, thin;
  for (int x = -900; x <= 900; x += 300)
    for (int y = -900; y <= 900; y += 300) steep.add(x, y, x / 2);  // 26.6 degrees
  for (int i = 0; i < 9; ++i) thin.add(100 * (i % 3), 100 * (i / 3), 0);
  EXPECT_EQ(model_node(steep.points(), NodeModelRules(with(NodeModel::kPca))).node_class, NodeClass::kNoPlane);
  EXPECT_EQ(model_node(thin.points(), NodeModelRules(with(NodeModel::kPca, 10))).node_class, NodeClass::kNoPlane);
  EXPECT_EQ(model_node(thin.points(), NodeModelRules(with(NodeModel::kPca, 9))).node_class, NodeClass::kCandidate);
}

TEST(NodeModelDegenerate, ExtremesStayExact) {
  // The largest square, heights across the whole range, very many points: no overflow, the same for any order.
  NodeCloud c;
  Random random(5);
  for (int i = 0; i < 300'000; ++i)
    c.add(static_cast<int>(random.between(-32767, 32766)), static_cast<int>(random.between(-32767, 32766)),
          static_cast<int>(random.between(-kMaxVertical_mm, kMaxVertical_mm)));
  for (const NodeModel model : {NodeModel::kPca, NodeModel::kRobust}) {
    Parameters p = with(model);
    p.resolution_m = 64;
    const Node n = model_node(c.points(), NodeModelRules(p));
    EXPECT_EQ(n, model_longhand(c.points(), NodeModelRules(p)));
    EXPECT_EQ(n.count, 300'000u);
    EXPECT_TRUE(normal_of(n).allFinite());
  }
}

TEST(NodeModelDegenerate, OneStrayPointBelowTakesOnlyItsNode) {
  NodeCloud c;
  for (int x = -900; x <= 900; x += 100)
    for (int y = -900; y <= 900; y += 100) c.add(x, y, 0);
  c.add(1, 2, -300'000);
  const Node n = model_node(c.points(), NodeModelRules(with(NodeModel::kRobust)));
  EXPECT_EQ(n.node_class, NodeClass::kNoPlane) << "left to completion";
}

}  // namespace
}  // namespace btms::test
