// Trial: the maths never returns NaN or Inf, and is right where the points say what is right.
//
// Random nodes at a UTM offset: planes of all slopes, noise, lines, few places, millimetre and hundred-metre spreads.
// Each goes through the engine and through the paper's equations as printed, in 128-bit floating point on absolute
// metres (Eq 1-3, 5; for every fourth, a prediction from these nodes, Eq 7-11 as printed, and a corner).
//
// Compared before rounding where the engine has doubles (mean, eigenvalues, normal, weight), after it within half the
// stored quantum. What is compared where:
//   mean    everywhere
//   normal, weight   where l1 / (l2 - l3) <= 10^4: beyond, the eigenvector of l3 is lost in rounding, as it is in the
//           coordinates themselves (millimetres)
//   class (no plane, candidate)   where l2, the slope and the number of points are not at their thresholds
//   prediction   its height where it exists; its normal where the proposals do not cancel (|sum k u| >= 0.05 sum k)
// Heights beyond the 262 m of a node that the engine clamps to, the robust selection and the levels' nodes have no
// oracle here: their numbers must be finite and in range (tests/engine compares them with longhand integers).
#include <quadmath.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <vector>

#include "engine/lattice/lattice.h"
#include "engine/terrain/completion.h"
#include "engine/terrain/corner_fit.h"
#include "engine/terrain/lane_moments.h"
#include "engine/terrain/level_fit.h"
#include "engine/terrain/node_model.h"
#include "engine/terrain/symmetric_eigen.h"
#include "tests/support/cloud.h"
#include "tests/support/node_cloud.h"

#pragma GCC diagnostic ignored "-Wpsabi"  // lanes are inlined

namespace btms::test {
namespace {

using Quad = __float128;
using Vector = std::array<Quad, 3>;
const Quad kQuadPi = acosq(-1);

constexpr double kWellPosed = 1e4;  // l1 / (l2 - l3)
constexpr double kLine_m2 = 1e-6;   // l2 of points on a line: a square millimetre
constexpr double kNormal_rad = 1e-6, kHeight_m = 1e-6, kWeight = 1e-6;

// A node's cloud: millimetres in the map's frame, and from the square's centre as the engine takes them.
struct Sample {
  std::int32_t r_mm = 0;
  std::int64_t centre_x_mm = 0, centre_y_mm = 0;
  NodeCloud cloud;
  bool within_relief = true;
};

Sample draw(Random& random) {
  Sample s;
  s.r_mm = static_cast<std::int32_t>(2 * random.between(50, 8000));
  const Lattice lattice(s.r_mm);
  const Cell cell = lattice.cell_at(500'000'000 + random.between(-90'000'000, 90'000'000),
                                    4'500'000'000 + random.between(-90'000'000, 90'000'000));
  s.centre_x_mm = lattice.centre_x_mm(cell);
  s.centre_y_mm = lattice.centre_y_mm(cell);
  const std::int64_t half = s.r_mm / 2, n = random.between(0, 9) == 0 ? random.between(0, 4) : random.between(0, 200);
  const std::int64_t kind = random.between(0, 7), base = random.between(-500'000, 4'000'000);
  const std::int64_t rise_x = random.between(-3000, 3000) / (random.between(0, 1) == 0 ? 1 : 20),
                     rise_y = random.between(-3000, 3000) / (random.between(0, 1) == 0 ? 1 : 20);
  const std::int64_t noise = std::int64_t{1} << random.between(0, 9), spread = kind == 5 ? random.between(0, 1) : 0;
  std::array<std::array<std::int64_t, 2>, 5> places;
  for (auto& p : places) p = {random.between(-half, half - 1), random.between(-half, half - 1)};
  const std::int64_t few = random.between(1, 5), jitter = random.between(0, 3);
  for (std::int64_t i = 0; i < n; ++i) {
    std::int64_t x = random.between(-half, half - 1), y = random.between(-half, half - 1);
    if (kind == 2) {  // a line, nearly
      const std::int64_t t = random.between(0, 1000);
      x = (places[0][0] * t + places[1][0] * (1000 - t)) / 1000 + random.between(-jitter, jitter);
      y = (places[0][1] * t + places[1][1] * (1000 - t)) / 1000;
    } else if (kind == 3) {  // a few places, many times
      const auto& p = places[static_cast<std::size_t>(random.between(0, few - 1))];
      x = p[0], y = p[1];
    } else if (kind == 4) {  // millimetres
      x = places[0][0] / 2 + random.between(-few, few), y = places[0][1] / 2 + random.between(-few, few);
    } else if (kind == 6) {  // an upright sheet
      x = places[0][0] + random.between(-jitter, jitter);
    }
    x = std::clamp(x, -half, half - 1), y = std::clamp(y, -half, half - 1);
    std::int64_t z = base + (x * rise_x + y * rise_y) / 1000;
    if (kind == 0) z += random.between(0, 2) - 1;                    // a plane, and rounding
    if (kind == 1 || kind == 7) z += random.between(-noise, noise);  // noise
    if (kind == 2) z += random.between(-jitter, jitter);
    if (kind == 3) z += random.between(0, few) * noise;
    if (kind == 4) z = base + random.between(-few, few);
    if (kind == 5) z = base + random.between(0, spread == 0 ? 250'000 : 100'000'000);  // huge
    if (kind == 6) z = base + random.between(0, 20 * noise);
    s.cloud.add(x, y, z);
  }
  if (n > 0) {
    const auto [low, high] = std::minmax_element(s.cloud.z.begin(), s.cloud.z.end());
    s.within_relief = std::int64_t{*high} - *low <= kMaxNodeRelief_mm;
  }
  return s;
}

// Eq 2 and 3 in absolute metres.
struct Oracle {
  Quad n = 0;
  Vector mean{}, normal{0, 0, 1};
  std::array<Quad, 3> l{};  // descending, m^2
  Quad weight = 0;
  double condition() const { return static_cast<double>(l[0] / (l[1] - l[2])); }
};

Oracle evaluate(const Sample& s) {
  Oracle o;
  o.n = static_cast<Quad>(s.cloud.x.size());
  if (s.cloud.x.empty()) return o;
  std::vector<Vector> points;
  for (std::size_t i = 0; i < s.cloud.x.size(); ++i) {
    points.push_back({static_cast<Quad>(s.centre_x_mm + s.cloud.x[i]) / 1000,
                      static_cast<Quad>(s.centre_y_mm + s.cloud.y[i]) / 1000, static_cast<Quad>(s.cloud.z[i]) / 1000});
    for (std::size_t k = 0; k < 3; ++k) o.mean[k] += points.back()[k] / o.n;
  }
  Quad a[3][3] = {}, v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (const Vector& p : points)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) a[i][j] += (p[i] - o.mean[i]) * (p[j] - o.mean[j]) / o.n;
  // Jacobi rotations until nothing is left beside the diagonal.
  for (int sweep = 0; sweep < 30; ++sweep) {
    const Quad beside = fabsq(a[0][1]) + fabsq(a[0][2]) + fabsq(a[1][2]);
    if (beside <= static_cast<Quad>(1e-33) * (a[0][0] + a[1][1] + a[2][2])) break;
    for (const auto& [p, q] : {std::pair{0, 1}, {0, 2}, {1, 2}}) {
      if (a[p][q] == 0) continue;
      const Quad theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
      const Quad t = (theta >= 0 ? 1 : -1) / (fabsq(theta) + sqrtq(theta * theta + 1));
      const Quad c = 1 / sqrtq(t * t + 1), sine = t * c;
      for (int k = 0; k < 3; ++k) {
        const Quad x = a[k][p], y = a[k][q], vx = v[k][p], vy = v[k][q];
        a[k][p] = c * x - sine * y, a[k][q] = sine * x + c * y;
        v[k][p] = c * vx - sine * vy, v[k][q] = sine * vx + c * vy;
      }
      for (int k = 0; k < 3; ++k) {
        const Quad x = a[p][k], y = a[q][k];
        a[p][k] = c * x - sine * y, a[q][k] = sine * x + c * y;
      }
    }
  }
  std::array<std::size_t, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return a[i][i] > a[j][j]; });
  for (std::size_t k = 0; k < 3; ++k) o.l[k] = fmaxq(a[order[k]][order[k]], 0);
  const Quad up = v[2][order[2]] < 0 ? -1 : 1;
  for (std::size_t k = 0; k < 3; ++k) o.normal[k] = v[k][order[2]] * up;
  if (o.l[0] > 0) o.weight = (1 - o.l[2] / o.l[0]) * ((o.l[1] - o.l[2]) / o.l[0]);
  return o;
}

// Angle between a unit vector of doubles and one of the oracle.
double angle(const std::array<double, 3>& a, const Vector& b) {
  const Vector q{a[0], a[1], a[2]};
  const Vector cross{q[1] * b[2] - q[2] * b[1], q[2] * b[0] - q[0] * b[2], q[0] * b[1] - q[1] * b[0]};
  const Quad sine = sqrtq(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
  return static_cast<double>(asinq(fminq(sine, 1)));
}

struct Worst {
  double value = 0, limit;
  std::uint64_t compared = 0, beyond = 0;
  explicit Worst(double l) : limit(l) {}
  void add(double error, double allowed = 0) {
    ++compared;
    value = std::max(value, error);
    if (!(error <= std::max(limit, allowed))) ++beyond;
  }
};

class Trial {
 public:
  void node(Random& random) {
    const Sample s = draw(random);
    const Oracle o = evaluate(s);
    ++nodes_;
    pca_.min_points = robust_.min_points = static_cast<std::uint32_t>(random.between(3, 20));
    const Node n = through(s, pca_);
    finite(n, s);
    finite(through(s, robust_), s);
    level(s, random);
    if (!s.within_relief || s.cloud.x.empty()) return;
    if (s.cloud.x.size() >= 3) before_rounding(s, o);
    classes(n, o);
    if (n.node_class == NodeClass::kCandidate) {
      ++candidates_;
      after_rounding(n, s, o);
      near_.push_back(n);
      if (near_.size() == 4) {
        predict(random);
        near_.clear();
      }
    }
  }

  bool report() const {
    const auto line = [](const char* what, const Worst& w, const char* unit) {
      std::printf("%-34s %9llu compared, worst %.3g %s, %llu beyond the limit\n", what,
                  static_cast<unsigned long long>(w.compared), w.value, unit,
                  static_cast<unsigned long long>(w.beyond));
    };
    line("mean before rounding", mean_, "m");
    line("height of the plane at a corner", plane_, "m");
    line("normal before rounding", normal_, "rad");
    line("weight before rounding", weight_, "");
    line("mean as stored", stored_mean_, "m");
    line("normal as stored", stored_normal_, "rad");
    line("height of a prediction", predicted_z_, "m");
    line("normal of a prediction", predicted_normal_, "rad");
    line("weight of a prediction", predicted_weight_, "");
    line("height of a corner", corner_, "m");
    for (std::size_t k = 0; k < by_condition_.size(); ++k)
      if (by_condition_[k].compared > 0)
        std::printf("  normal where l1 / (l2 - l3) < 1e%zu: %llu nodes, worst %.3g rad\n", k + 1,
                    static_cast<unsigned long long>(by_condition_[k].compared), by_condition_[k].value);
    std::printf("%llu candidates, %llu of another class than the oracle says, %llu at a threshold\n",
                static_cast<unsigned long long>(candidates_), static_cast<unsigned long long>(other_class_),
                static_cast<unsigned long long>(at_threshold_));
    std::uint64_t beyond = 0;
    for (const Worst* w : {&mean_, &plane_, &normal_, &weight_, &stored_mean_, &stored_normal_, &predicted_z_,
                           &predicted_normal_, &predicted_weight_, &corner_})
      beyond += w->beyond;
    // Without these the trial would say nothing.
    const bool compared = candidates_ * 20 > nodes_ && predicted_normal_.compared > candidates_ / 40;
    if (!compared) std::printf("too few candidates or predictions to say anything\n");
    std::printf("%llu nodes: %llu NaN, Inf or out of range; normal within %.2g rad, z within %.2g m; %llu beyond\n",
                static_cast<unsigned long long>(nodes_), static_cast<unsigned long long>(not_finite_), normal_.value,
                std::max(mean_.value, plane_.value), static_cast<unsigned long long>(beyond + other_class_));
    return compared && beyond == 0 && not_finite_ == 0 && other_class_ == 0;
  }

 private:
  Node through(const Sample& s, const NodeModelRules& rules) {
    FourPoints four;
    four[nodes_ % 4] = s.cloud.points();
    std::array<Node, 4> out;
    model_four(four, rules, scratch_, out.data());
    return out[nodes_ % 4];
  }

  void require(bool good) { not_finite_ += !good; }
  // Stored numbers are integers: what was NaN before would show as the end of a range or far from the points.
  void finite(const Node& n, const Sample& s) {
    if (s.cloud.x.empty()) return require(n == Node{});
    const auto [low, high] = std::minmax_element(s.cloud.z.begin(), s.cloud.z.end());
    require(n.mean_z_mm >= *low && n.mean_z_mm <= *high && std::abs(n.mean_x_mm) <= s.r_mm / 2 &&
            std::abs(n.mean_y_mm) <= s.r_mm / 2 && n.count == s.cloud.x.size());
    const Eigen::Vector3d normal = normal_of(n);
    require(normal.allFinite() && std::abs(normal.norm() - 1) < 1e-4);
  }

  void level(const Sample& s, Random& random) {
    const bool first = random.between(0, 3) == 0;
    const LevelRules rules(city_, s.r_mm, first, !first);
    const double height = s.cloud.z.empty() ? 0 : s.cloud.z[0] + static_cast<double>(random.between(-2000, 2000));
    const PriorPlane prior{height, static_cast<double>(random.between(-2000, 2000)) / 1000,
                           static_cast<double>(random.between(-2000, 2000)) / 1000, 50};
    LevelNode n = fit_level_node(s.cloud.points(), static_cast<std::uint8_t>(nodes_ % 4), prior, rules, gated_);
    const double steepest = (city_.slope_limit + 1e-3) * kSlopeUnit;
    require(std::hypot(n.slope_x, n.slope_y) <= steepest && std::abs(n.mean_x_mm) <= s.r_mm / 2 &&
            std::abs(n.mean_y_mm) <= s.r_mm / 2);
    if (n.level_class != LevelClass::kEmpty) {
      const auto [low, high] = std::minmax_element(s.cloud.z.begin(), s.cloud.z.end());
      require(n.weight > 0 && n.mean_z_mm >= *low && n.mean_z_mm <= *high);
    }
    classify(n, prior, rules);
    require(n.level_class <= LevelClass::kAbove);
  }

  // The same sums and eigenvectors as the engine's, taken before they are stored.
  void before_rounding(const Sample& s, const Oracle& o) {
    const std::int32_t datum = *std::min_element(s.cloud.z.begin(), s.cloud.z.end());
    Moments<Lanes> m;
    for (std::size_t i = 0; i < s.cloud.x.size(); ++i)
      m.add(Lanes{} + 1.0, Lanes{} + static_cast<double>(s.cloud.x[i]), Lanes{} + static_cast<double>(s.cloud.y[i]),
            Lanes{} + static_cast<double>(s.cloud.z[i] - datum), LongLanes{} - 1);
    const EigenSystems e = solve_eigen(covariance(m));
    require(std::isfinite(e.l1[0]) && std::isfinite(e.l2[0]) && std::isfinite(e.l3[0]) && e.l3[0] >= 0 &&
            std::isfinite(e.normal_x[0]) && std::isfinite(e.normal_y[0]) && e.normal_z[0] >= 0);
    const std::array<double, 3> mean{m.x[0] / m.n[0], m.y[0] / m.n[0], m.z[0] / m.n[0]};
    const std::array<Quad, 3> origin{static_cast<Quad>(s.centre_x_mm), static_cast<Quad>(s.centre_y_mm),
                                     static_cast<Quad>(datum)};
    for (std::size_t k = 0; k < 3; ++k) mean_.add(static_cast<double>(fabsq((origin[k] + mean[k]) / 1000 - o.mean[k])));
    if (o.l[1] <= kLine_m2) return;  // no plane
    const double condition = o.condition(), error = angle({e.normal_x[0], e.normal_y[0], e.normal_z[0]}, o.normal);
    const double decade = std::floor(std::log10(condition));
    by_condition_[static_cast<std::size_t>(std::clamp(decade, 0.0, 9.0))].add(error);
    if (condition > kWellPosed) return;
    normal_.add(error);
    weight_.add(std::abs((1 - e.l3[0] / e.l1[0]) * ((e.l2[0] - e.l3[0]) / e.l1[0]) - static_cast<double>(o.weight)));
    // As far from the mean as a corner can be; only slopes that pass for terrain are asked for heights.
    if (o.normal[2] < 0.9) return;
    const double x = s.r_mm / 2.0 - mean[0], y = s.r_mm / 2.0 - mean[1];
    const double z = mean[2] - (e.normal_x[0] * x + e.normal_y[0] * y) / e.normal_z[0];
    const Quad truth = o.mean[2] - (o.normal[0] * ((origin[0] + s.r_mm / static_cast<Quad>(2)) / 1000 - o.mean[0]) +
                                    o.normal[1] * ((origin[1] + s.r_mm / static_cast<Quad>(2)) / 1000 - o.mean[1])) /
                                       o.normal[2];
    plane_.add(static_cast<double>(fabsq((origin[2] + z) / 1000 - truth)));
  }

  void classes(const Node& n, const Oracle& o) {
    const Quad steepest = cosq(20 * kQuadPi / 180);
    const bool plane = o.n >= 3 && o.l[1] > kLine_m2,
               candidate = plane && o.n >= pca_.min_points && o.normal[2] >= steepest;
    if (fabsq(o.l[1] - kLine_m2) < 1e-6 * kLine_m2 || (plane && fabsq(o.normal[2] - steepest) < 1e-4) ||
        (plane && o.condition() > kWellPosed))
      ++at_threshold_;
    else
      other_class_ += (n.node_class == NodeClass::kCandidate) != candidate || (n.sd_mm > 0 && !plane);
  }

  static constexpr double kHalfMillimetre = 0.5e-3 * (1 + 1e-9), kHalfNormal = 0.5 / kNormalUnit;

  void after_rounding(const Node& n, const Sample& s, const Oracle& o) {
    const std::array<std::int64_t, 3> stored{s.centre_x_mm + n.mean_x_mm, s.centre_y_mm + n.mean_y_mm, n.mean_z_mm};
    for (std::size_t k = 0; k < 3; ++k)
      stored_mean_.add(static_cast<double>(fabsq(static_cast<Quad>(stored[k]) / 1000 - o.mean[k])));
    if (o.condition() > kWellPosed) return;
    const Eigen::Vector3d v = normal_of(n);
    stored_normal_.add(angle({v.x(), v.y(), v.z()}, o.normal));
  }

  // Four of the nodes, put around a square, predict its nodes and meet at its corner.
  void predict(Random& random) {
    constexpr double kR_m = 6;
    const std::int32_t half = 3000, l = static_cast<std::int32_t>(rules_.radius_mm);
    const std::int64_t base = near_[0].mean_z_mm;
    std::vector<Neighbour> near;
    std::vector<std::array<std::int32_t, 2>> at;
    for (Node& n : near_) {
      n.node_class = NodeClass::kTerrain;
      n.weight = std::max<std::uint16_t>(n.weight, 1);
      n.mean_z_mm = static_cast<std::int32_t>(base + random.between(-1500, 1500));
      at.push_back({static_cast<std::int32_t>(random.between(-l / 2, l / 2)),
                    static_cast<std::int32_t>(random.between(-l / 2, l / 2))});
      near.push_back(neighbour_of(n, at.back()[0], at.back()[1]));
    }
    std::array<Node, kTriangles> square, by_plane;
    const std::array<std::uint32_t, 4> all{0, 1, 2, 3};
    predict_square(square.data(), 0, 0, near, all, rules_, completion_);
    predict_square(by_plane.data(), 0, 0, near, all, plane_rules_, completion_);
    for (std::uint8_t t = 0; t < kTriangles; ++t) {
      const Node &n = square[t], &p = by_plane[t];
      if (p.node_class == NodeClass::kPredicted)
        require(normal_of(p).allFinite() && std::abs(p.mean_z_mm - base) < 60'000 && p.weight > 0);
      if (n.node_class != NodeClass::kPredicted) continue;
      // Eq 7 as printed, Eq 8
      const Quad r = kR_m, cx = static_cast<Quad>(centroid_x3(t, 6000)) / 3000,
                 cy = static_cast<Quad>(centroid_y3(t, 6000)) / 3000;
      std::array<Quad, 4> k{};
      Quad support = 0, z = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        const Quad dx = static_cast<Quad>(at[i][0]) / 1000 - cx, dy = static_cast<Quad>(at[i][1]) / 1000 - cy;
        const Quad d = sqrtq(dx * dx + dy * dy) / (static_cast<Quad>(parameters_.kernel_radius) * r);
        if (d < 1) k[i] = (2 + cosq(2 * kQuadPi * d)) * (1 - d) / 3 + sinq(2 * kQuadPi * d) / (2 * kQuadPi);
        support += k[i];
        z += k[i] * static_cast<Quad>(near_[i].mean_z_mm) / 1000;
      }
      // A kernel value is rounded to 2^-24, and heights are 1.5 m from their middle.
      const double kernel_noise = 4 * std::ldexp(1.0, -24) / static_cast<double>(support);
      predicted_z_.add(static_cast<double>(fabsq(z / support - static_cast<Quad>(n.mean_z_mm) / 1000)),
                       kHalfMillimetre + 3 * kernel_noise);
      // Eq 9-11 at the place as the node keeps it.
      Vector sum{}, mean{};
      for (std::size_t i = 0; i < 4; ++i) {
        const Quad dx = n.mean_x_mm - at[i][0], dy = n.mean_y_mm - at[i][1], dz = n.mean_z_mm - near_[i].mean_z_mm;
        const Eigen::Vector3d own = normal_of(near_[i]);
        const Quad flat = sqrtq(dx * dx + dy * dy), length = sqrtq(dx * dx + dy * dy + dz * dz);
        const Vector u = flat > 0 ? Vector{-dx / flat * dz / length, -dy / flat * dz / length, flat / length}
                                  : Vector{own.x(), own.y(), own.z()};
        for (std::size_t c = 0; c < 3; ++c) {
          sum[c] += k[i] * u[c];
          mean[c] += k[i] * (near_[i].weight / kWeightUnit) * own[static_cast<int>(c)] / support;
        }
      }
      const Quad length = sqrtq(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]), share = length / support;
      if (share < 0.05) continue;
      for (Quad& c : sum) c /= length;
      const Eigen::Vector3d v = normal_of(n);
      // Rounding of x and y turns steep normals further: by 1 / s_z.
      const double turned = kernel_noise / static_cast<double>(share) + 2 * std::ldexp(1.0, -24);
      predicted_normal_.add(angle({v.x(), v.y(), v.z()}, sum),
                            1.5 * kHalfNormal / std::max(1e-3, static_cast<double>(sum[2])) + turned);
      const Quad weight = mean[0] * sum[0] + mean[1] * sum[1] + mean[2] * sum[2];
      predicted_weight_.add(std::abs(n.weight / kWeightUnit - static_cast<double>(fmaxq(weight, 0))),
                            0.51 / kWeightUnit + kHalfNormal + 2 * turned);
    }
    // The corner at (half, half), seen from each square as if they shared it.
    CornerMean corner;
    Quad weighted = 0, weights = 0;
    for (const Node& n : near_) {
      corner.add(CornerPlane(n), half, half);
      const Eigen::Vector3d v = normal_of(n);
      const Quad x = half - n.mean_x_mm, y = half - n.mean_y_mm;
      const Quad w = n.weight / fmaxq(1, sqrtq(x * x + y * y));
      weighted +=
          w * (n.mean_z_mm - (static_cast<Quad>(v.x()) * x + static_cast<Quad>(v.y()) * y) / static_cast<Quad>(v.z()));
      weights += w;
    }
    corner_.add(static_cast<double>(fabsq(weighted / weights - corner.height_mm()) / 1000));
  }

  static Parameters parameters(CompletionNormals normals) {
    Parameters p = preset("paper-partial-map");
    p.node_model = NodeModel::kPca;
    p.slope_max_deg = 20;
    p.resolution_m = 6;
    p.completion_normals = normals;
    return p;
  }
  static Parameters steep(Parameters p) {
    p.slope_max_deg = 80;
    return p;
  }
  static NodeModelRules robust() {
    Parameters p = parameters(CompletionNormals::kFaithful);
    p.node_model = NodeModel::kRobust;
    return NodeModelRules(p);
  }

  const Parameters parameters_ = steep(parameters(CompletionNormals::kFaithful)), city_ = preset("city");
  NodeModelRules pca_{parameters(CompletionNormals::kFaithful)}, robust_ = robust();
  const CompletionRules rules_{parameters_}, plane_rules_{steep(parameters(CompletionNormals::kPlane))};
  ModelScratch scratch_;
  CompletionScratch completion_;
  GatedPoints gated_;
  std::vector<Node> near_;

  std::uint64_t nodes_ = 0, candidates_ = 0, not_finite_ = 0, other_class_ = 0, at_threshold_ = 0;
  Worst mean_{kHeight_m}, plane_{kHeight_m}, normal_{kNormal_rad}, weight_{kWeight};
  Worst stored_mean_{kHalfMillimetre}, stored_normal_{1.5 * kHalfNormal + kNormal_rad};
  Worst predicted_z_{0}, predicted_normal_{0}, predicted_weight_{0}, corner_{kHalfMillimetre};
  std::array<Worst, 10> by_condition_ = [] {
    const Worst any(INFINITY);
    return std::array{any, any, any, any, any, any, any, any, any, any};
  }();
};

}  // namespace
}  // namespace btms::test

int main(int argc, char** argv) {
  CLI::App app("Random nodes at a UTM offset against the paper's equations in 128-bit floating point");
  std::uint64_t nodes = 1'000'000, seed = 1;
  app.add_option("nodes", nodes, "Nodes to try");
  app.add_option("--seed", seed, "Others");
  CLI11_PARSE(app, argc, argv);
  btms::test::Random random(seed);
  btms::test::Trial trial;
  for (std::uint64_t i = 1; i <= nodes; ++i) {
    trial.node(random);
    if (i % 100'000 == 0) std::printf("%llu nodes\n", static_cast<unsigned long long>(i)), std::fflush(stdout);
  }
  return trial.report() ? 0 : 1;
}
