#include "engine/terrain/above.h"

#include <algorithm>
#include <cmath>

#include "engine/lattice/wide.h"

namespace btms {
namespace {

constexpr std::uint32_t kSheetPoints = 3;

PriorPlane prior_of(const FinalPlane& surface, std::int32_t r_mm, std::int32_t raised_mm) {
  return {static_cast<double>(surface.centre_mm) + raised_mm, static_cast<double>(surface.rise_x_mm) / r_mm,
          static_cast<double>(surface.rise_y_mm) / r_mm, 0};
}

// Points on a plane, and points so near that they leave no room over or under it.
struct Presence {
  std::uint32_t on = 0, near = 0;
  std::uint64_t squares_mm2 = 0;  // of those on it
};

// Precondition: on_mm <= near_mm.
BTMS_WIDE Presence presence(const NodePoints& points, const LevelNode& plane, double on_mm, double near_mm) {
  const double a = plane.slope_x / kSlopeUnit, b = plane.slope_y / kSlopeUnit;
  const double mean_x = plane.mean_x_mm, mean_y = plane.mean_y_mm, mean_z = plane.mean_z_mm;
  Presence out;
  for (std::size_t i = 0; i < points.size; ++i) {
    const double exact = points.z_mm[i] - mean_z - (a * (points.x_mm[i] - mean_x) + b * (points.y_mm[i] - mean_y));
    const double e = std::abs(exact) <= near_mm ? exact : 2 * near_mm;
    const std::uint32_t on = std::abs(e) <= on_mm ? 1 : 0;
    const auto whole = static_cast<std::uint32_t>(std::abs(static_cast<std::int32_t>(round_half_up(e)))) * on;
    out.near += std::abs(e) <= near_mm ? 1U : 0U;
    out.on += on;
    out.squares_mm2 += std::uint64_t{whole} * whole;
  }
  return out;
}

// Few, mostly in some order already.
void sort_few(std::span<std::int64_t> v) {
  if (v.size() > 32) return std::sort(v.begin(), v.end());
  for (std::size_t i = 1; i < v.size(); ++i) {
    const std::int64_t value = v[i];
    std::size_t at = i;
    for (; at > 0 && v[at - 1] > value; --at) v[at] = v[at - 1];
    v[at] = value;
  }
}

}  // namespace

BTMS_WIDE NodeLook look_over(const NodePoints& points, const FinalPlane& surface, std::int32_t r_mm,
                             std::int32_t terrain_mm, std::int32_t room_mm, std::int32_t* heights) {
  const double a = static_cast<double>(surface.rise_x_mm) / r_mm, b = static_cast<double>(surface.rise_y_mm) / r_mm;
  const double c = static_cast<double>(surface.centre_mm);
  constexpr std::uint32_t kNegative = std::uint32_t{1} << 31;
  std::uint32_t lowest = kNegative;  // over terrain_mm + 1; what is not above is negative, as unsigned the greatest
  std::uint32_t on = 0, off = 0;
  std::uint64_t squares = 0;
  for (std::size_t i = 0; i < points.size; ++i) {
    const double exact = points.z_mm[i] - c - (a * points.x_mm[i] + b * points.y_mm[i]);
    const auto h = static_cast<std::int32_t>(std::clamp(round_half_up(exact), -2147483647.0, 2147483647.0));
    heights[i] = h;
    lowest = std::min(lowest, static_cast<std::uint32_t>(h) - static_cast<std::uint32_t>(terrain_mm + 1));
    const std::uint32_t is_on = std::abs(h) <= terrain_mm ? 1 : 0;
    const std::uint32_t e = static_cast<std::uint32_t>(std::abs(h)) * is_on;
    squares += std::uint32_t{e * e};  // terrain_mm has 16 bits
    on += is_on;
    off += (h > terrain_mm ? 1U : 0U) | (h < -room_mm ? 1U : 0U);
  }
  NodeLook look;
  if (on > 0) look.roughness_mm = saturate_u16(std::sqrt(static_cast<double>(squares) / on));
  if (lowest < kNegative) look.clearance_mm = static_cast<std::int32_t>(lowest) + terrain_mm + 1;
  look.off = off;
  return look;
}

SheetFinder::SheetFinder(const LevelRules& rules)
    : rules_(rules),
      room_mm_(static_cast<std::int32_t>(round_half_up(rules.p().upper_gap_m * 1000))),
      split_mm_(
          static_cast<std::int32_t>(round_half_up((rules.p().link_m + rules.p().link_per_r * rules.r_m()) * 1000))) {}

void SheetFinder::find(const Square& square) {
  std::size_t rounds = 0;
  for (std::size_t t = 0; t < kTriangles; ++t) {
    nodes_[t].groups.clear();
    nodes_[t].sheets.clear();
    split(square[t], nodes_[t]);
    rounds = std::max(rounds, nodes_[t].groups.size());
  }
  // The first groups of the four nodes, a lane each, then the second.
  for (std::size_t k = 0; k < rounds; ++k) {
    SquarePoints points{};
    SquarePriors priors{};
    for (std::size_t t = 0; t < kTriangles; ++t) {
      const Node& node = nodes_[t];
      if (k >= node.groups.size()) continue;
      const auto [from, to, lowest_mm] = node.groups[k];
      points[t] = {node.x_mm.data() + from, node.y_mm.data() + from, node.z_mm.data() + from, to - from};
      priors[t] = prior_of(square[t].surface, rules_.r_mm(), lowest_mm);
    }
    std::array<LevelNode, kTriangles> fitted;
    fit_level_square(points, priors, rules_, gated_, fitted.data());
    for (std::size_t t = 0; t < kTriangles; ++t)
      if (points[t].size > 0 && fitted[t].level_class == LevelClass::kNear)
        keep(square[t], fitted[t], nodes_[t].sheets);
  }
}

// Groups that may be sheets.
void SheetFinder::split(const PointsOverSurface& node, Node& out) {
  if (node.off < kSheetPoints) return;
  // No branch: whether a point is off the surface is hard to foresee.
  if (order_.size() < node.points.size) order_.resize(node.points.size);
  std::size_t n = 0;
  std::int32_t lowest = INT32_MAX, highest = INT32_MIN;
  for (std::size_t i = 0; i < node.points.size; ++i) {
    const std::int32_t h = node.heights_mm[i];
    const bool off = (h > node.terrain_mm) | (h < -room_mm_);
    order_[n] = std::int64_t{h} * (std::int64_t{1} << 32) + static_cast<std::int64_t>(i);
    n += off ? 1 : 0;
    lowest = std::min(lowest, off ? h : INT32_MAX);
    highest = std::max(highest, off ? h : INT32_MIN);
  }
  if (std::int64_t{highest} - lowest <= std::min(split_mm_, 2 * room_mm_))
    out.groups.push_back({0, n, lowest});  // one group, whatever the order
  else
    split_sorted(n, out.groups);
  if (out.groups.empty()) return;
  out.x_mm.resize(n);
  out.y_mm.resize(n);
  out.z_mm.resize(n);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = static_cast<std::uint32_t>(order_[k]);
    out.x_mm[k] = node.points.x_mm[i];
    out.y_mm[k] = node.points.y_mm[i];
    out.z_mm[k] = node.points.z_mm[i];
  }
}

// The first n of order_.
void SheetFinder::split_sorted(std::size_t n, std::vector<Group>& groups) {
  sort_few({order_.data(), n});
  const auto height = [&](std::size_t k) { return static_cast<std::int32_t>(order_[k] >> 32); };
  for (std::size_t from = 0, to; from < n; from = to) {
    for (to = from + 1; to < n && height(to) - height(to - 1) <= split_mm_; ++to) {
    }
    if (to - from < kSheetPoints) continue;
    // Most groups of a tree have as many points of others within that room, or are too tall for one plane: no fit.
    if (height(to - 1) - height(from) > 2 * room_mm_) continue;
    const std::int32_t middle = height(from + (to - from) / 2);
    std::size_t others = 0;
    for (std::size_t k = from; k > 0 && height(k - 1) >= middle - room_mm_; --k) ++others;
    for (std::size_t k = to; k < n && height(k) <= middle + room_mm_; ++k) ++others;
    if (others < to - from) groups.push_back({from, to, height(from)});
  }
}

// A plane is a sheet when most of what is near it lies on it.
void SheetFinder::keep(const PointsOverSurface& node, LevelNode plane, std::vector<NodeSheet>& sheets) const {
  const LevelParameters& q = rules_.p();
  const double ax = plane.slope_x / kSlopeUnit, ay = plane.slope_y / kSlopeUnit;
  const double near_mm = q.upper_gap_m * 1000;
  const double on_mm = std::min(near_mm, q.fit_scale_last_m * 1000 * (1 + std::sqrt(ax * ax + ay * ay)));
  const Presence seen = presence(node.points, plane, on_mm, near_mm);
  if (seen.on < kSheetPoints || 2 * seen.on <= seen.near) return;
  plane.count = static_cast<std::uint16_t>(std::min<std::uint32_t>(seen.on, 65535));
  plane.sd_mm = saturate_u16(std::sqrt(static_cast<double>(seen.squares_mm2) / seen.on));
  const std::int32_t above_mm =
      height_mm(plane.mean_z_mm - prior_of(node.surface, rules_.r_mm(), 0).at(plane.mean_x_mm, plane.mean_y_mm));
  sheets.push_back({plane, above_mm});
}

LevelNode surface_node(std::uint8_t triangle, const FinalPlane& surface, std::int32_t r_mm) {
  const PriorPlane plane = prior_of(surface, r_mm, 0);
  LevelNode node;
  node.mean_x_mm = static_cast<std::int16_t>(floor_div(centroid_x3(triangle, r_mm) + 1, 3));
  node.mean_y_mm = static_cast<std::int16_t>(floor_div(centroid_y3(triangle, r_mm) + 1, 3));
  node.mean_z_mm = height_mm(plane.at(node.mean_x_mm, node.mean_y_mm));
  node.slope_x = stored_slope(plane.slope_x);
  node.slope_y = stored_slope(plane.slope_y);
  return node;
}

std::int32_t height_at_centre_mm(const LevelNode& plane) {
  return height_mm(plane.mean_z_mm -
                   (plane.slope_x / kSlopeUnit * plane.mean_x_mm + plane.slope_y / kSlopeUnit * plane.mean_y_mm));
}

}  // namespace btms
