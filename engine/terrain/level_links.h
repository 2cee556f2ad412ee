// Links and rims between neighbouring nodes of a level, and the verdict on whole components (steps 5 and 6).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "engine/terrain/level_fit.h"
#include "engine/terrain/level_node.h"

namespace btms {

struct LevelEdge {
  bool linked = false;
  int step = 0;  // +1: a stands above b by more than a step, -1: below, 0: level
};

// (dx, dy): from a's square centre to b's, millimetres. Links are symmetric to the bit; a step is counted once, with
// the node of the smaller key as a.
inline LevelEdge compare(const LevelNode& a, const LevelNode& b, std::int32_t dx_mm, std::int32_t dy_mm,
                         const LevelRules& rules) {
  const LevelParameters& q = rules.p();
  const double r_m = rules.r_m();
  const double ax = a.slope_x / kSlopeUnit, ay = a.slope_y / kSlopeUnit, bx = b.slope_x / kSlopeUnit,
               by = b.slope_y / kSlopeUnit;
  const double dx = dx_mm + b.mean_x_mm - a.mean_x_mm, dy = dy_mm + b.mean_y_mm - a.mean_y_mm;
  const double rise = static_cast<double>(a.mean_z_mm) - b.mean_z_mm;
  // Difference of the planes halfway between the means.
  const double gap = rise + ((ax + bx) * dx + (ay + by) * dy) / 2;
  const double bend = std::sqrt((ax - bx) * (ax - bx) + (ay - by) * (ay - by));
  const double slope = std::sqrt(std::min(ax * ax + ay * ay, bx * bx + by * by));
  LevelEdge edge;
  edge.linked = (std::abs(gap) < (q.link_m + q.link_per_r * r_m) * 1000 && bend < q.link_slope * (1 + slope)) ||
                std::abs(rise) < q.link_flat_m * 1000;
  const double step = round_half_up(std::abs(rise) < std::abs(gap) ? rise : gap);
  const double limit = (q.step_m + q.step_per_r * r_m * (1 + slope)) * 1000;
  edge.step = step > limit ? 1 : step < -limit ? -1 : 0;
  return edge;
}

// What is known of a component: sums over its nodes.
struct ComponentSums {
  std::uint64_t nodes = 0;
  std::int64_t above_mm = 0;      // sum of d
  std::int64_t tolerance_mm = 0;  // sum of t
  std::uint64_t open = 0;         // edges to nodes without a plane
  bool above = false;             // class of all its nodes
  std::uint64_t passages = 0;     // times the sensor passed over it

  friend bool operator==(const ComponentSums&, const ComponentSums&) = default;
  ComponentSums& operator+=(const ComponentSums& o) {
    nodes += o.nodes;
    above_mm += o.above_mm;
    tolerance_mm += o.tolerance_mm;
    open += o.open;
    above |= o.above;
    passages += o.passages;
    return *this;
  }
};

// Edges along its rim towards components that still stand.
struct RimCounts {
  std::uint64_t rim = 0, up = 0, agree = 0;

  friend bool operator==(const RimCounts&, const RimCounts&) = default;
  RimCounts& operator+=(const RimCounts& o) {
    rim += o.rim, up += o.up, agree += o.agree;
    return *this;
  }
};

// An island: components of both classes that agree, taken together. Once a prior has climbed a roof, a part of the roof
// is near it and the rest above, and each would be a witness for the other; together they have walls all round. An edge
// to nothing may hide more ground and counts in part against walls, or all plateaus at the end of the data would go.
inline bool rejected_island(const ComponentSums& island, const RimCounts& rim) {
  constexpr double kWalls = 0.8, kOpen = 0.3;
  return island.passages == 0 && rim.rim > 0 &&
         static_cast<double>(rim.up) >
             kWalls * (static_cast<double>(rim.rim) + kOpen * static_cast<double>(island.open));
}

// True when the component is not terrain.
inline bool rejected(const ComponentSums& c, const RimCounts& rim, const LevelRules& rules) {
  if (c.passages > 0) return false;
  const LevelParameters& q = rules.p();
  const auto n = static_cast<double>(rim.rim), up = static_cast<double>(rim.up), agree = static_cast<double>(rim.agree);
  const bool small = c.nodes < static_cast<std::uint64_t>(q.small_nodes);
  if (c.above) {
    const double agreeing = agree / std::max(1.0, n);
    if (agreeing < q.agree) return true;
    if (rim.rim == 0 || up > q.above_up * n) return true;
    return small && agreeing < q.agree_small;
  }
  const auto d = static_cast<double>(c.above_mm), t = static_cast<double>(c.tolerance_mm);
  // Without a prior fewer walls are enough: what is ground climbs back on the next level.
  if (rules.first()) return rim.rim > 0 && up > q.first_up * n;
  if (rim.rim > 0 && up > q.near_up * n && d > q.near_residual * t) return true;
  return small && d < -q.low_residual * t;
}

}  // namespace btms
