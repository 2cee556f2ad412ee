#include "engine/terrain/level_edges.h"

#include <limits>

#include "engine/lattice/lanes.h"

namespace btms {
namespace {

static_assert(kTriangles == kLanes);

}  // namespace

BTMS_WIDE void NodeRow::assign(std::span<const LevelNode> squares) {
  const std::size_t n = squares.size() / kTriangles, padded = n + 2 * kLanes;
  for (std::size_t t = 0; t < kTriangles; ++t) {
    Nodes& to = nodes_[t];
    if (to.x_mm.size() < padded)
      for (std::vector<double>* v : {&to.x_mm, &to.y_mm, &to.z_mm, &to.slope_x, &to.slope_y, &to.slope})
        v->resize(padded);
    // Nothing compares with a height that is none.
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t i = 0; i < n; ++i) {
      const LevelNode& node = squares[i * kTriangles + t];
      to.x_mm[i] = node.mean_x_mm;
      to.y_mm[i] = node.mean_y_mm;
      to.z_mm[i] = node.has_plane() ? node.mean_z_mm : kNone;
      to.slope_x[i] = node.slope_x / kSlopeUnit;
      to.slope_y[i] = node.slope_y / kSlopeUnit;
    }
    for (std::size_t i = n; i < padded; ++i) to.z_mm[i] = kNone;
    for (std::size_t i = 0; i < n; i += kLanes) {
      const Lanes x = load_lanes(&to.slope_x[i]), y = load_lanes(&to.slope_y[i]);
      store_lanes(&to.slope[i], sqrt_lanes(x * x + y * y));
    }
  }
}

EdgeRules::EdgeRules(const LevelRules& rules)
    : r_mm_(rules.r_mm()),
      near_mm_((rules.p().link_m + rules.p().link_per_r * rules.r_m()) * 1000),
      bend_(rules.p().link_slope),
      flat_mm_(rules.p().link_flat_m * 1000),
      step_m_(rules.p().step_m),
      step_per_slope_(rules.p().step_per_r * rules.r_m()) {}

BTMS_WIDE void EdgeRules::compare(const NodeRow& row, const NodeRow& north, std::span<ForwardEdges> out) const {
  const std::size_t n = out.size() / kTriangles;
  for (std::size_t t = 0; t < kTriangles; ++t)
    for (std::size_t i = 0; i < n; i += kLanes) {
      const NodeRow::Nodes& a = row.nodes_[t];
      const std::size_t here = i + 1;
      const Lanes ax = load_lanes(&a.slope_x[here]), ay = load_lanes(&a.slope_y[here]),
                  a_slope = load_lanes(&a.slope[here]);
      const Lanes x = load_lanes(&a.x_mm[here]), y = load_lanes(&a.y_mm[here]), z = load_lanes(&a.z_mm[here]);
      LongLanes linked{}, above{}, below{};
      for (int k = 0; k < kForwardTable[t].count; ++k) {
        const NodeOffset& o = kForwardTable[t].offset[static_cast<std::size_t>(k)];
        const NodeRow::Nodes& b = (o.row > 0 ? north : row).nodes_[o.triangle];
        const std::size_t there = here + static_cast<std::size_t>(o.col);
        const Lanes bx = load_lanes(&b.slope_x[there]), by = load_lanes(&b.slope_y[there]),
                    b_slope = load_lanes(&b.slope[there]);
        const Lanes dx = load_lanes(&b.x_mm[there]) - x + o.col * r_mm_,
                    dy = load_lanes(&b.y_mm[there]) - y + o.row * r_mm_;
        const Lanes rise = z - load_lanes(&b.z_mm[there]);
        // Difference of the planes halfway between the means.
        const Lanes gap = rise + ((ax + bx) * dx + (ay + by) * dy) / 2.0;
        const Lanes bend = sqrt_lanes((ax - bx) * (ax - bx) + (ay - by) * (ay - by));
        const Lanes slope = a_slope < b_slope ? a_slope : b_slope;
        const LongLanes one = LongLanes{} + (std::int64_t{1} << k);
        linked |= one & (((abs_lanes(gap) < near_mm_) & (bend < bend_ * (1.0 + slope))) | (abs_lanes(rise) < flat_mm_));
        const Lanes step = floor_lanes((abs_lanes(rise) < abs_lanes(gap) ? rise : gap) + 0.5);
        const Lanes limit = (step_m_ + step_per_slope_ * (1.0 + slope)) * 1000.0;
        above |= one & (step > limit);
        below |= one & (step < -limit);
      }
      for (std::size_t lane = 0; lane < kLanes && i + lane < n; ++lane)
        out[(i + lane) * kTriangles + t] = {static_cast<std::uint16_t>(linked[lane]),
                                            static_cast<std::uint16_t>(above[lane]),
                                            static_cast<std::uint16_t>(below[lane])};
    }
}

}  // namespace btms
