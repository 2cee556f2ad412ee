#include "engine/terrain/level_fit.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/lattice/lattice.h"
#include "engine/terrain/moments.h"

namespace btms {
namespace {

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
  std::nth_element(z.begin(), sorted, z.end());
  std::sort(z.begin(), sorted);
  std::size_t low = 0;
  while (low + 3 < z.size() && static_cast<double>(low) < most_isolated &&
         static_cast<double>(std::int64_t{z[low + 2]} - z[low]) > gap_mm)
    ++low;
  const auto below = static_cast<std::size_t>(static_cast<double>(z.size() - low) * quantile);
  const auto at = z.begin() + static_cast<std::ptrdiff_t>(std::min(low + below, z.size() - 1));
  const std::int32_t not_isolated_mm = z[low];
  if (at >= sorted) std::nth_element(sorted, at, z.end());
  return {not_isolated_mm, *at};
}

void store_plane(LevelNode& node, double x, double y, double z, double slope_x, double slope_y) {
  node.mean_x_mm = static_cast<std::int16_t>(round_half_up(x));
  node.mean_y_mm = static_cast<std::int16_t>(round_half_up(y));
  node.mean_z_mm = height_mm(z);
  node.slope_x = stored_slope(slope_x);
  node.slope_y = stored_slope(slope_y);
}

// The prior as a fit sees it: through its height at the node's centroid, with a clamped slope; none on the first level.
struct FitPrior {
  PriorPlane plane;
  double slope;             // of the plane
  double x_mm, y_mm, z_mm;  // the centroid

  FitPrior(std::uint8_t triangle, const PriorPlane& given, const LevelRules& rules)
      : plane(rules.first() ? PriorPlane{} : given),
        x_mm(rules.centroid(triangle).x_mm),
        y_mm(rules.centroid(triangle).y_mm) {
    const double limit = rules.p().slope_limit, steep = plane.slope();
    if (steep > limit) {
      const double at_centroid = plane.at(x_mm, y_mm), shorten = limit / steep;
      plane.slope_x *= shorten;
      plane.slope_y *= shorten;
      plane.z = at_centroid - plane.slope_x * x_mm - plane.slope_y * y_mm;
    }
    slope = std::min(steep, limit);
    z_mm = plane.at(x_mm, y_mm);
  }
  // What is known without points.
  LevelNode node() const {
    LevelNode node;
    node.level_class = LevelClass::kEmpty;
    store_plane(node, x_mm, y_mm, z_mm, plane.slope_x, plane.slope_y);
    return node;
  }
};

PlaneFitRules fit_rules(const LevelRules& rules) {
  const double r_m = rules.r_m();
  if (rules.first()) return {8, rules.p().first_ridge * r_m * r_m * 0.055 * 1e6, false, 2.0};
  return {3, rules.p().ridge * r_m * r_m * 0.11 * 1e6, true, 0.5};
}

// A node's points on their way to a plane: heights from a datum that does not depend on the order of the points.
struct LaneStart {
  std::int32_t datum_mm = 0;
  PlaneStart start;
};

// On the first level: flat, nothing below the first point that is not isolated. Precondition: at least three points.
LaneStart start_first(std::size_t lane, const NodePoints& points, const LevelRules& rules, GatedPoints& gated) {
  const LevelParameters& q = rules.p();
  const double r_m = rules.r_m();
  const LowestPoints lowest = lowest_points(points, (q.first_gap_m + q.first_gap_per_r * r_m) * 1000, q.first_quantile);
  gated.assign(lane, points, lowest.not_isolated_mm, FixedLevelPlane::of(0, 0, 0));
  const double z = std::min<double>(lowest.quantile_mm - lowest.not_isolated_mm, kMaxNodeRelief_mm);
  const double scale_m = q.first_scale_m + q.first_scale_per_r * r_m;
  return {lowest.not_isolated_mm,
          {FixedLevelPlane::of(0, 0, z), 0, 0, scale_m * 1000, std::min(scale_m, q.fit_scale_last_m) * 1000}};
}

// Through the lowest point that passes the gate, parallel to the prior.
LaneStart start_on_prior(std::size_t lane, const NodePoints& points, const FitPrior& prior, const LevelRules& rules,
                         GatedPoints& gated) {
  const LevelParameters& q = rules.p();
  const double r_m = rules.r_m();
  const auto datum_mm = static_cast<std::int32_t>(round_half_up(prior.z_mm));
  FixedLevelPlane plane = FixedLevelPlane::of(prior.plane.slope_x, prior.plane.slope_y, prior.plane.z - datum_mm);
  plane.c -= static_cast<std::int64_t>(
      round_half_up((q.gate_m + q.gate_per_r * r_m * (1 + prior.slope)) * 1000 * FixedLevelPlane::kUnit));
  const std::int64_t lowest = gated.assign(lane, points, datum_mm, plane);
  if (gated.size(lane) > 0) plane.c += lowest;
  const double scale_m = rules.fit_scale_m(prior.slope);
  return {
      datum_mm,
      {plane, prior.plane.slope_x, prior.plane.slope_y, scale_m * 1000, std::min(scale_m, q.fit_scale_last_m) * 1000}};
}

}  // namespace

LevelRules::LevelRules(const LevelParameters& p, std::int32_t r_mm, bool first, bool last)
    : p_(p), r_mm_(r_mm), first_(first), last_(last), fit_scale_m_(p.fit_scale_m), fit_scale_slope_(p.fit_scale_slope) {
  // On the finest level planes are small enough for the ground to be flat within one: what stands out is no ground.
  if (last && p.fit_scale_ground == 0) {
    fit_scale_m_ = p.fit_scale_fine_m;
    fit_scale_slope_ = p.fit_scale_fine_slope;
  }
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    const std::int64_t x3 = centroid_x3(t, r_mm), y3 = centroid_y3(t, r_mm);
    centroids_[t] = {x3,
                     y3,
                     static_cast<double>(x3) / 3,
                     static_cast<double>(y3) / 3,
                     static_cast<std::int16_t>(floor_div(x3 + 1, 3)),
                     static_cast<std::int16_t>(floor_div(y3 + 1, 3))};
  }
}

LevelRules LevelRules::following(double ground_mm) const {
  LevelRules rules = *this;
  rules.fit_scale_m_ = std::max(p_.fit_scale_fine_m, p_.fit_scale_ground * ground_mm / 1000);
  rules.fit_scale_slope_ = p_.fit_scale_fine_slope;
  return rules;
}

std::int32_t LevelRules::completion_halo() const {
  // On the first level the radius may double twice.
  const double reach = p_.level_kernel_radius * (first_ ? 4 : 1);
  return static_cast<std::int32_t>(std::ceil(reach - 1.0 / 6));
}

void fit_level_square(const SquarePoints& points, const SquarePriors& given, const LevelRules& rules,
                      GatedPoints& gated, LevelNode* nodes) {
  const LevelParameters& q = rules.p();
  const double half = rules.r_mm() / 2.0;
  std::array<LaneStart, kTriangles> lanes;
  PlaneStarts starts;
  gated.clear();
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    if (points[t].size < (rules.first() ? 3 : 1)) continue;
    lanes[t] = rules.first() ? start_first(t, points[t], rules, gated)
                             : start_on_prior(t, points[t], FitPrior(t, given[t], rules), rules, gated);
    starts[t] = lanes[t].start;
  }
  std::array<FittedPlane, kTriangles> fits;
  if (gated.longest() > 0) {
    gated.pad();
    fits = fit_planes(gated, starts, fit_rules(rules));
  }
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    const FittedPlane& fit = fits[t];
    LevelNode& node = nodes[t];
    node = fit.fitted ? LevelNode{} : FitPrior(t, given[t], rules).node();
    node.count = static_cast<std::uint16_t>(std::min<std::size_t>(points[t].size, 65535));
    if (!fit.fitted) continue;
    double gx = fit.slope_x, gy = fit.slope_y;
    const double slope = std::sqrt(gx * gx + gy * gy);
    if (slope > q.slope_limit) {
      gx *= q.slope_limit / slope;
      gy *= q.slope_limit / slope;
    }
    store_plane(node, std::clamp(fit.x_mm, -half, half), std::clamp(fit.y_mm, -half, half),
                lanes[t].datum_mm + fit.z_mm, gx, gy);
    node.weight = saturate_u16(fit.weight / (fit.weight + 1) * kWeightUnit);
    node.sd_mm = saturate_u16(rules.first() ? fit.rms_mm : std::max(fit.rms_mm, q.inherit * given[t].sd_mm));
    node.level_class =
        fit.weight >= (rules.first() ? q.first_min_weight : q.min_weight) ? LevelClass::kNear : LevelClass::kThin;
  }
}

LevelNode fit_level_node(const NodePoints& points, std::uint8_t triangle, const PriorPlane& prior,
                         const LevelRules& rules, GatedPoints& gated) {
  SquarePoints square{};
  SquarePriors priors{};
  square[triangle] = points;
  priors[triangle] = prior;
  std::array<LevelNode, kTriangles> nodes;
  fit_level_square(square, priors, rules, gated, nodes.data());
  return nodes[triangle];
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
