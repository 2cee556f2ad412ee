#include "engine/terrain/level_fit.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/lattice/lattice.h"

namespace btms {
namespace {

// n ab - a b, exact, then one rounding to double.
double central_product(std::int64_t n, std::int64_t ab, std::int64_t a, std::int64_t b) {
  std::int64_t whole, means, difference;
  if (!__builtin_mul_overflow(n, ab, &whole) && !__builtin_mul_overflow(a, b, &means) &&
      !__builtin_sub_overflow(whole, means, &difference))
    return static_cast<double>(difference);
  return static_cast<double>(static_cast<__int128>(n) * ab - static_cast<__int128>(a) * b);
}

// Where a fit without a prior starts.
struct LowestPoints {
  std::int32_t not_isolated_mm;  // the first with two others not further above it than the gap
  std::int32_t quantile_mm;      // of the points from there on
};

// Precondition: at least three points.
LowestPoints lowest_points(const NodePoints& points, double gap_mm, double quantile) {
  std::vector<std::int32_t> z(points.z_mm, points.z_mm + points.size);
  const double most_isolated = static_cast<double>(z.size()) * 0.05 + 1;
  // Only so many need be in order.
  const auto sorted =
      z.begin() + static_cast<std::ptrdiff_t>(std::min(z.size(), static_cast<std::size_t>(most_isolated) + 4));
  std::partial_sort(z.begin(), sorted, z.end());
  std::size_t low = 0;
  while (low + 3 < z.size() && static_cast<double>(low) < most_isolated &&
         static_cast<double>(std::int64_t{z[low + 2]} - z[low]) > gap_mm)
    ++low;
  const auto at = z.begin() + static_cast<std::ptrdiff_t>(
                                  low + static_cast<std::size_t>(static_cast<double>(z.size() - low) * quantile));
  const std::int32_t not_isolated_mm = z[low];
  if (at >= sorted) std::nth_element(sorted, at, z.end());
  return {not_isolated_mm, *at};
}

}  // namespace

double PriorPlane::slope() const { return std::sqrt(slope_x * slope_x + slope_y * slope_y); }

LevelRules::LevelRules(const LevelParameters& p, std::int32_t r_mm, bool first, bool last)
    : p_(p), r_mm_(r_mm), first_(first), last_(last) {}

std::int32_t LevelRules::completion_halo() const {
  // On the first level the radius may double twice.
  const double reach = p_.level_kernel_radius * (first_ ? 4 : 1);
  return static_cast<std::int32_t>(std::ceil(reach - 1.0 / 6));
}

LevelNode fit_level_node(const NodePoints& points, std::uint8_t triangle, const PriorPlane& given,
                         const LevelRules& rules, GatedPoints& gated) {
  const LevelParameters& q = rules.p();
  const double r_m = rules.r_m(), r_mm = rules.r_mm();
  LevelNode node;
  node.level_class = LevelClass::kEmpty;

  // The prior through its height at the centroid, with a clamped slope.
  const double cx = static_cast<double>(centroid_x3(triangle, rules.r_mm())) / 3;
  const double cy = static_cast<double>(centroid_y3(triangle, rules.r_mm())) / 3;
  PriorPlane prior = given;
  if (rules.first()) prior = {};
  const double steep = prior.slope();
  if (steep > q.slope_limit) {
    const double at_centroid = prior.at(cx, cy), shorten = q.slope_limit / steep;
    prior.slope_x *= shorten;
    prior.slope_y *= shorten;
    prior.z = at_centroid - prior.slope_x * cx - prior.slope_y * cy;
  }
  const double slope = std::min(steep, q.slope_limit);
  const auto store = [&](double x, double y, double z, double gx, double gy) {
    node.mean_x_mm = static_cast<std::int16_t>(round_half_up(x));
    node.mean_y_mm = static_cast<std::int16_t>(round_half_up(y));
    node.mean_z_mm = height_mm(z);
    node.slope_x = stored_slope(gx);
    node.slope_y = stored_slope(gy);
  };
  store(cx, cy, prior.at(cx, cy), prior.slope_x, prior.slope_y);
  if (points.size == 0) return node;
  node.count = static_cast<std::uint16_t>(std::min<std::size_t>(points.size, 65535));

  // Heights from a datum that does not depend on the order of the points.
  std::int32_t datum;
  FixedLevelPlane gate, plane;
  double scale_m, ridge_m2;
  int fits;
  if (rules.first()) {
    if (points.size < 3) return node;
    const LowestPoints lowest =
        lowest_points(points, (q.first_gap_m + q.first_gap_per_r * r_m) * 1000, q.first_quantile);
    datum = lowest.not_isolated_mm;
    gate = FixedLevelPlane::of(0, 0, 0);  // nothing below the first point that is not isolated
    plane = FixedLevelPlane::of(0, 0, std::min<double>(lowest.quantile_mm - datum, kMaxNodeRelief_mm));
    gated.assign(points, datum, gate);
    scale_m = q.first_scale_m + q.first_scale_per_r * r_m;
    ridge_m2 = q.first_ridge * r_m * r_m * 0.055;  // per point
    fits = 8;
  } else {
    datum = static_cast<std::int32_t>(round_half_up(prior.at(cx, cy)));
    plane = FixedLevelPlane::of(prior.slope_x, prior.slope_y, prior.z - datum);
    const auto deep = static_cast<std::int64_t>(
        round_half_up((q.gate_m + q.gate_per_r * r_m * (1 + slope)) * 1000 * FixedLevelPlane::kUnit));
    gate = plane;
    gate.c -= deep;
    // Through the lowest point that passes the gate, parallel to the prior.
    const std::int64_t lowest = gated.assign(points, datum, gate);
    if (gated.size() == 0) return node;
    plane.c = gate.c + lowest;
    scale_m = q.fit_scale_m + q.fit_scale_slope * r_m * slope;
    ridge_m2 = q.ridge * r_m * r_m * 0.11;
    fits = 4;
  }

  double gx = prior.slope_x, gy = prior.slope_y, mx = 0, my = 0, mz = 0, weight = 0, rms_mm = 0;
  for (int fit = 0; fit < fits; ++fit) {
    const double s = fit == fits - 1 ? std::min(scale_m, q.fit_scale_last_m) : scale_m;
    const WeightedMoments m = WeightedMoments::of(gated, plane, s * 1000);
    weight = static_cast<double>(m.n) / kLevelWeightOne;
    if (weight < (rules.first() ? 2.0 : 0.5)) return node;
    const double n = static_cast<double>(m.n), n2 = n * n;
    mx = static_cast<double>(m.x) / n;
    my = static_cast<double>(m.y) / n;
    mz = static_cast<double>(m.z) / n;
    // Covariances (mm^2) times the weight, plus the ridge towards the prior's slope.
    const double ridge = ridge_m2 * 1e6 * (rules.first() ? 1.0 : 1.0 / weight);
    const double cxx = central_product(m.n, m.xx, m.x, m.x) / n2 + ridge,
                 cxy = central_product(m.n, m.xy, m.x, m.y) / n2;
    const double cyy = central_product(m.n, m.yy, m.y, m.y) / n2 + ridge;
    const double cxz = central_product(m.n, m.xz, m.x, m.z) / n2 + ridge * prior.slope_x;
    const double cyz = central_product(m.n, m.yz, m.y, m.z) / n2 + ridge * prior.slope_y;
    const double det = cxx * cyy - cxy * cxy;
    gx = std::clamp((cxz * cyy - cyz * cxy) / det, -7.9, 7.9);
    gy = std::clamp((cyz * cxx - cxz * cxy) / det, -7.9, 7.9);
    plane = FixedLevelPlane::of(gx, gy, mz - gx * mx - gy * my);
    rms_mm = std::sqrt(static_cast<double>(m.rr) / n);
  }
  const double fitted = std::sqrt(gx * gx + gy * gy);
  if (fitted > q.slope_limit) {
    gx *= q.slope_limit / fitted;
    gy *= q.slope_limit / fitted;
  }
  store(std::clamp(mx, -r_mm / 2, r_mm / 2), std::clamp(my, -r_mm / 2, r_mm / 2), datum + mz, gx, gy);
  node.weight = saturate_u16(weight / (weight + 1) * kWeightUnit);
  node.sd_mm = saturate_u16(rules.first() ? rms_mm : std::max(rms_mm, q.inherit * given.sd_mm));
  node.level_class =
      weight >= (rules.first() ? q.first_min_weight : q.min_weight) ? LevelClass::kNear : LevelClass::kThin;
  return node;
}

void classify(LevelNode& node, const PriorPlane& prior, const LevelRules& rules) {
  if (node.level_class != LevelClass::kNear && node.level_class != LevelClass::kAbove &&
      node.level_class != LevelClass::kRejected)
    return;
  node.level_class = LevelClass::kNear;
  node.above_prior_mm = 0;
  node.tolerance_mm = 1;
  if (!rules.first()) {
    const LevelParameters& q = rules.p();
    const double r_m = rules.r_m();
    const double above = node.mean_z_mm - prior.at(node.mean_x_mm, node.mean_y_mm);
    const double tolerance = q.near_m + q.near_per_r * r_m + q.near_slope * r_m * prior.slope() +
                             q.near_uncertainty * std::min(prior.sd_mm / 1000, q.near_uncertainty_cap_per_r * r_m);
    node.above_prior_mm = static_cast<std::int16_t>(std::clamp(round_half_up(above), -32767.0, 32767.0));
    node.tolerance_mm = saturate_u16(tolerance * 1000);
    if (above > tolerance * 1000) node.level_class = LevelClass::kAbove;
  }
}

}  // namespace btms
