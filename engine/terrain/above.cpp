#include "engine/terrain/above.h"

#include <algorithm>
#include <cmath>

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
  std::int64_t squares_mm2 = 0;
};

Presence presence(const NodePoints& points, const LevelNode& plane, double on_mm, double near_mm) {
  const double a = plane.slope_x / kSlopeUnit, b = plane.slope_y / kSlopeUnit;
  Presence out;
  for (std::size_t i = 0; i < points.size; ++i) {
    const double e = static_cast<double>(points.z_mm[i]) - plane.mean_z_mm -
                     (a * (points.x_mm[i] - plane.mean_x_mm) + b * (points.y_mm[i] - plane.mean_y_mm));
    if (std::abs(e) > near_mm) continue;
    ++out.near;
    if (std::abs(e) > on_mm) continue;
    ++out.on;
    const auto whole = static_cast<std::int64_t>(round_half_up(e));
    out.squares_mm2 += whole * whole;
  }
  return out;
}

}  // namespace

void heights_over(const NodePoints& points, const FinalPlane& plane, std::int32_t r_mm,
                  std::vector<std::int32_t>& heights) {
  const double a = static_cast<double>(plane.rise_x_mm) / r_mm, b = static_cast<double>(plane.rise_y_mm) / r_mm;
  const double c = static_cast<double>(plane.centre_mm);
  heights.resize(points.size);
  for (std::size_t i = 0; i < points.size; ++i)
    heights[i] = static_cast<std::int32_t>(std::clamp(
        round_half_up(points.z_mm[i] - c - (a * points.x_mm[i] + b * points.y_mm[i])), -2147483647.0, 2147483647.0));
}

NodeLayers node_layers(std::span<const std::int32_t> heights_mm, std::int32_t terrain_mm) {
  std::int64_t n = 0, squares = 0;
  NodeLayers out;
  for (const std::int32_t h : heights_mm) {
    if (h > terrain_mm) {
      out.clearance_mm = std::min(out.clearance_mm, h);
    } else if (h >= -terrain_mm) {
      ++n;
      squares += std::int64_t{h} * h;
    }
  }
  if (n > 0) out.roughness_mm = saturate_u16(std::sqrt(static_cast<double>(squares) / static_cast<double>(n)));
  return out;
}

void find_sheets(const NodePoints& points, std::span<const std::int32_t> heights_mm, std::uint8_t triangle,
                 const FinalPlane& surface, std::int32_t terrain_mm, const LevelRules& rules, SheetScratch& s,
                 std::vector<NodeSheet>& sheets) {
  sheets.clear();
  const LevelParameters& q = rules.p();
  const std::int32_t room_mm = static_cast<std::int32_t>(round_half_up(q.upper_gap_m * 1000));
  const std::int32_t split_mm =
      static_cast<std::int32_t>(round_half_up((q.link_m + q.link_per_r * rules.r_m()) * 1000));
  s.order.clear();
  for (std::size_t i = 0; i < heights_mm.size(); ++i)
    if (heights_mm[i] > terrain_mm || heights_mm[i] < -room_mm)
      s.order.push_back(std::int64_t{heights_mm[i]} * (std::int64_t{1} << 32) + static_cast<std::int64_t>(i));
  if (s.order.size() < kSheetPoints) return;
  std::sort(s.order.begin(), s.order.end());
  const auto height = [&](std::size_t k) { return static_cast<std::int32_t>(s.order[k] >> 32); };
  for (std::size_t from = 0, to; from < s.order.size(); from = to) {
    for (to = from + 1; to < s.order.size() && height(to) - height(to - 1) <= split_mm; ++to) {
    }
    if (to - from < kSheetPoints) continue;
    // Most groups of a tree have as many points of others within that room, or are too tall for one plane: no fit.
    const std::int32_t middle = height(from + (to - from) / 2);
    std::size_t others = 0;
    for (std::size_t k = from; k > 0 && height(k - 1) >= middle - room_mm; --k) ++others;
    for (std::size_t k = to; k < s.order.size() && height(k) <= middle + room_mm; ++k) ++others;
    if (others >= to - from || height(to - 1) - height(from) > 2 * room_mm) continue;
    s.x_mm.clear();
    s.y_mm.clear();
    s.z_mm.clear();
    for (std::size_t k = from; k < to; ++k) {
      const std::size_t i = static_cast<std::uint32_t>(s.order[k]);
      s.x_mm.push_back(points.x_mm[i]);
      s.y_mm.push_back(points.y_mm[i]);
      s.z_mm.push_back(points.z_mm[i]);
    }
    NodeSheet sheet;
    sheet.plane = fit_level_node({s.x_mm.data(), s.y_mm.data(), s.z_mm.data(), to - from}, triangle,
                                 prior_of(surface, rules.r_mm(), height(from)), rules, s.gated);
    if (sheet.plane.level_class != LevelClass::kNear) continue;
    const double ax = sheet.plane.slope_x / kSlopeUnit, ay = sheet.plane.slope_y / kSlopeUnit;
    const Presence seen = presence(points, sheet.plane, q.fit_scale_last_m * 1000 * (1 + std::sqrt(ax * ax + ay * ay)),
                                   q.upper_gap_m * 1000);
    if (seen.on < kSheetPoints || 2 * seen.on <= seen.near) continue;
    sheet.plane.count = static_cast<std::uint16_t>(std::min<std::uint32_t>(seen.on, 65535));
    sheet.plane.sd_mm = saturate_u16(std::sqrt(static_cast<double>(seen.squares_mm2) / seen.on));
    sheet.above_mm = height_mm(sheet.plane.mean_z_mm -
                               prior_of(surface, rules.r_mm(), 0).at(sheet.plane.mean_x_mm, sheet.plane.mean_y_mm));
    sheets.push_back(sheet);
  }
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
