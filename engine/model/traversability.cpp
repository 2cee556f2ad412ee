#include "engine/model/traversability.h"

#include <algorithm>
#include <cmath>

#include "engine/lattice/wide.h"
#include "engine/trigonometry.h"

namespace btms {
namespace {

struct Point {
  std::int64_t x, y;
};
constexpr Point operator-(Point a, Point b) { return {a.x - b.x, a.y - b.y}; }
constexpr std::int64_t dot(Point a, Point b) { return a.x * b.x + a.y * b.y; }

// Whether p is within `reach` of the segment ab, in exact integers; `unit` scales coordinates to the unit of `reach`.
bool within(Point p, Point a, Point b, std::int64_t unit, std::int64_t reach) {
  const Point d = b - a, v = p - a;
  const std::int64_t along = dot(v, d), length2 = dot(d, d), limit = reach * reach;
  if (along <= 0) return dot(v, v) * unit * unit <= limit;
  if (along >= length2) return dot(p - b, p - b) * unit * unit <= limit;
  const std::int64_t across = v.x * d.y - v.y * d.x;
  return across * across * unit * unit <= limit * length2;
}

// Nodes within width / 2 of the centroid of `triangle`. Positions are in r/6 from the centre of its square: centroids
// and corners are whole.
std::vector<NodeOffset> nodes_under(std::uint8_t triangle, std::int32_t rings, std::int64_t r_mm,
                                    std::int64_t width_mm) {
  const Point p{centroid_x3(triangle, 2), centroid_y3(triangle, 2)};
  std::vector<NodeOffset> out;
  for (std::int32_t row = -rings; row <= rings; ++row)
    for (std::int32_t col = -rings; col <= rings; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const auto rel = triangle_corners(t);
        const auto corner = [&](int k) {
          return Point{3 * (rel[static_cast<std::size_t>(k)].x - 1) + 6 * col,
                       3 * (rel[static_cast<std::size_t>(k)].y - 1) + 6 * row};
        };
        const bool own = row == 0 && col == 0 && t == triangle;
        // width / 2 in millimetres is 3 width in units of r/6, times r.
        if (own || within(p, corner(0), corner(1), r_mm, 3 * width_mm) ||
            within(p, corner(1), corner(2), r_mm, 3 * width_mm) || within(p, corner(2), corner(0), r_mm, 3 * width_mm))
          out.push_back({static_cast<std::int8_t>(col), static_cast<std::int8_t>(row), t});
      }
  return out;
}

// A corner of a neighbour: the neighbour's place in kNeighbourTable, which of its corners, and where that lies, in r/2
// from the centre of the node's square.
struct Look {
  std::uint8_t neighbour, corner;
  std::int8_t x, y;
};
struct Looks {
  std::array<Look, 3 * kNeighbours> all{};  // those that name a corner first, then the others
  std::size_t distinct = 0;
};

constexpr Looks looks_of(std::uint8_t triangle) {
  Looks looks, repeated;
  std::size_t repeats = 0;
  for (std::uint8_t k = 0; k < kNeighbours; ++k)
    for (std::uint8_t c = 0; c < 3; ++c) {
      const NodeOffset o = kNeighbourTable[triangle][k];
      const HalfCell h = triangle_corners(o.triangle)[c];
      const Look look{k, c, static_cast<std::int8_t>(h.x + 2 * o.col - 1),
                      static_cast<std::int8_t>(h.y + 2 * o.row - 1)};
      bool known = false;
      for (const HalfCell& own : triangle_corners(triangle)) known |= own.x - 1 == look.x && own.y - 1 == look.y;
      for (std::size_t i = 0; i < looks.distinct; ++i) known |= looks.all[i].x == look.x && looks.all[i].y == look.y;
      if (known)
        repeated.all[repeats++] = look;
      else
        looks.all[looks.distinct++] = look;
    }
  for (std::size_t i = 0; i < repeats; ++i) looks.all[looks.distinct + i] = repeated.all[i];
  return looks;
}
constexpr std::array<Looks, kTriangles> kLooks = {looks_of(0), looks_of(1), looks_of(2), looks_of(3)};

// The heights at one place around every square of a row, x and y in r/2 from its centre: both odd at lattice corners,
// both even at centres.
const std::int32_t* heights_at(const HeightRows& rows, int x, int y) {
  if (x % 2 != 0) return rows.corner_mm[static_cast<std::size_t>((y + 3) / 2)] + (x + 3) / 2;
  return rows.centre_mm[static_cast<std::size_t>((y + 2) / 2)] + (x + 2) / 2;
}

// How far the heights of a place are above or below the planes of the squares.
struct LookRow {
  const std::int32_t* z_mm;
  std::int32_t x, y;  // in r/2
};

// Restricted: without it the compiler gives up, there are too many columns to check that none overlaps.
BTMS_WIDE void look_along(const LookRow& look, std::size_t n, const std::int32_t* centre, const std::int32_t* rise_x,
                          const std::int32_t* rise_y, std::int32_t* __restrict above2, std::int32_t* __restrict below2,
                          std::int32_t* __restrict low, std::int32_t* __restrict high) {
  const std::int32_t x = look.x, y = look.y;
  const std::int32_t* z = look.z_mm;
  for (std::size_t i = 0; i < n; ++i) {
    const std::int32_t off2 = 2 * (z[i] - centre[i]) - rise_x[i] * x - rise_y[i] * y;
    above2[i] = std::max(above2[i], off2);
    below2[i] = std::max(below2[i], -off2);
    low[i] = std::min(low[i], z[i]);
    high[i] = std::max(high[i], z[i]);
  }
}

}  // namespace

std::uint16_t step_mm(std::uint8_t triangle, const NodeCorners& own,
                      const std::array<const NodeCorners*, kNeighbours>& around) {
  const FinalPlane plane = FinalPlane::through(triangle, own.mm);
  auto [low, high] = std::minmax({own.mm[0], own.mm[1], own.mm[2]});
  std::int64_t above = 0, below = 0;  // twice the greatest distances
  // A corner has one height, whoever names it; but where somebody is unknown, another has to name it.
  const bool whole = std::all_of(around.begin(), around.end(), [](const NodeCorners* n) { return n->known(); });
  const Looks& looks = kLooks[triangle];
  for (std::size_t i = 0; i < (whole ? looks.distinct : looks.all.size()); ++i) {
    const Look look = looks.all[i];
    const NodeCorners& near = *around[look.neighbour];
    if (!near.known()) continue;
    const std::int32_t z = near.mm[look.corner];
    const std::int64_t off = 2 * (z - plane.centre_mm) - plane.rise_x_mm * look.x - plane.rise_y_mm * look.y;
    above = std::max(above, off);
    below = std::max(below, -off);
    low = std::min(low, z);
    high = std::max(high, z);
  }
  const std::int64_t step = std::min({above, below, std::int64_t{high} - low});
  return static_cast<std::uint16_t>(std::min<std::int64_t>((step + 5) / 10 * 10, 65530));
}

std::span<const std::uint16_t> StepRow::of(std::uint8_t triangle, const HeightRows& rows, std::size_t squares) {
  const std::size_t n = squares;
  auto& [centre, rise_x, rise_y, above2, below2, low, high] = columns_;
  for (auto* column : {&centre, &rise_x, &rise_y, &above2, &below2, &low, &high}) column->resize(n);
  steps_mm_.resize(n);
  std::array<const std::int32_t*, 3> own;
  const auto rel = triangle_corners(triangle);
  for (std::size_t k = 0; k < 3; ++k) own[k] = heights_at(rows, rel[k].x - 1, rel[k].y - 1);
  for (std::size_t i = 0; i < n; ++i) {
    const std::int32_t m = own[0][i], p = own[1][i], q = own[2][i];
    const FinalPlane plane = FinalPlane::through(triangle, {m, p, q});
    centre[i] = m;
    rise_x[i] = static_cast<std::int32_t>(plane.rise_x_mm);
    rise_y[i] = static_cast<std::int32_t>(plane.rise_y_mm);
    above2[i] = below2[i] = 0;
    low[i] = std::min({m, p, q});
    high[i] = std::max({m, p, q});
  }
  const Looks& looks = kLooks[triangle];
  for (std::size_t k = 0; k < looks.distinct; ++k) {
    const Look at = looks.all[k];
    look_along({heights_at(rows, at.x, at.y), at.x, at.y}, n, centre.data(), rise_x.data(), rise_y.data(),
               above2.data(), below2.data(), low.data(), high.data());
  }
  for (std::size_t i = 0; i < n; ++i) {
    const auto step = static_cast<std::uint32_t>(std::min({above2[i], below2[i], high[i] - low[i]}));
    steps_mm_[i] = static_cast<std::uint16_t>(std::min<std::uint32_t>((step + 5) / 10 * 10, 65530));
  }
  return steps_mm_;
}

Vehicle::Vehicle(const Parameters& p)
    : steepest_rise_mm_(resolution_mm(p) * sine(radians(p.vehicle_max_slope_deg)) /
                        cosine(radians(p.vehicle_max_slope_deg))),
      highest_step_mm_(p.vehicle_max_step_m * 1000),
      height_mm_(p.vehicle_height_m * 1000) {
  const std::int64_t r_mm = resolution_mm(p);
  const auto width_mm = static_cast<std::int64_t>(std::floor(p.vehicle_width_m * 1000 + 0.5));
  // A centroid lies at least r/6 inside its square.
  const std::int64_t sixths = 3 * width_mm - r_mm;
  if (sixths >= 0) rings_ = static_cast<std::int32_t>(sixths / (6 * r_mm) + 1);
  for (std::uint8_t t = 0; t < kTriangles; ++t) footprint_[t] = nodes_under(t, rings_, r_mm, width_mm);
}

std::uint8_t Vehicle::cost(const NodeSurface& node, const FinalPlane& plane) const {
  if (node.state != NodeState::kObserved && node.state != NodeState::kPredicted) return kNotTraversable;
  if (node.clearance_mm != kNothingAbove && node.clearance_mm < height_mm_) return kNotTraversable;
  const double slope = std::sqrt(static_cast<double>(plane.rise2_mm2())) / steepest_rise_mm_;
  const double step = node.step_mm / highest_step_mm_;
  if (slope > 1 || step > 1) return kNotTraversable;
  const double rough = std::min(1.0, 2 * node.roughness_mm / highest_step_mm_);
  return static_cast<std::uint8_t>(254 * std::max({slope, step, rough}) + 0.5);
}

}  // namespace btms
