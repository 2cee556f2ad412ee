#include "engine/terrain/node_model.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/lattice/lanes.h"
#include "engine/lattice/wide.h"
#include "engine/terrain/lane_moments.h"
#include "engine/terrain/symmetric_eigen.h"
#include "engine/trigonometry.h"

namespace btms {
namespace {

// Planes in fixed point for the selection of points: slopes and offset in 2^-12. Below a quarter millimetre over 2 m,
// and the test of a point against it is exact.
constexpr int kPlaneBits = 12;
constexpr double kPlaneUnit = 1 << kPlaneBits;
constexpr double kSteepestFit = 7.9;  // slopes beyond are clamped: they fail Eq 5 anyway
constexpr int kRefits = 3;

constexpr double kPadding_mm = 1 << 30;  // height of lanes' missing points: above any plane

// z = (a x + b y + c) / 2^12
struct FixedPlanes {
  Lanes a{}, b{}, c{};
};

// The points of four nodes, a lane each; z from each node's datum, clamped.
struct LanePoints {
  const double *x_mm, *y_mm;
  double* z_mm;
  std::size_t size;  // of the fullest node, times kLanes
};

// Four consecutive values of every lane, side by side.
template <class Four, class Value>
BTMS_INLINE void interleave_four(const Value* const (&from)[kLanes], std::size_t i, double* to) {
  Lanes v[kLanes];
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    Four four;
    std::memcpy(&four, from[lane] + i, sizeof four);
    v[lane] = __builtin_convertvector(__builtin_convertvector(four, IntLanes), Lanes);
  }
  const Lanes low01 = __builtin_shufflevector(v[0], v[1], 0, 4, 2, 6);
  const Lanes high01 = __builtin_shufflevector(v[0], v[1], 1, 5, 3, 7);
  const Lanes low23 = __builtin_shufflevector(v[2], v[3], 0, 4, 2, 6);
  const Lanes high23 = __builtin_shufflevector(v[2], v[3], 1, 5, 3, 7);
  to += i * kLanes;
  store_lanes(to, __builtin_shufflevector(low01, low23, 0, 1, 4, 5));
  store_lanes(to + kLanes, __builtin_shufflevector(high01, high23, 0, 1, 4, 5));
  store_lanes(to + 2 * kLanes, __builtin_shufflevector(low01, low23, 2, 3, 6, 7));
  store_lanes(to + 3 * kLanes, __builtin_shufflevector(high01, high23, 2, 3, 6, 7));
}

BTMS_INLINE LanePoints interleave(const FourPoints& four, ModelScratch& s) {
  std::size_t longest = 0, shortest = SIZE_MAX;
  for (const NodePoints& p : four) longest = std::max(longest, p.size), shortest = std::min(shortest, p.size);
  if (s.x_mm.size() < longest * kLanes) {
    s.x_mm.resize(longest * kLanes);
    s.y_mm.resize(longest * kLanes);
    s.z_mm.resize(longest * kLanes);
  }
  const std::size_t full = shortest / kLanes * kLanes;  // the rest goes point by point
  for (std::size_t i = 0; i < full; i += kLanes) {
    interleave_four<ShortLanes>({four[0].x_mm, four[1].x_mm, four[2].x_mm, four[3].x_mm}, i, s.x_mm.data());
    interleave_four<ShortLanes>({four[0].y_mm, four[1].y_mm, four[2].y_mm, four[3].y_mm}, i, s.y_mm.data());
    interleave_four<IntLanes>({four[0].z_mm, four[1].z_mm, four[2].z_mm, four[3].z_mm}, i, s.z_mm.data());
  }
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const NodePoints& p = four[lane];
    double *x = s.x_mm.data() + lane, *y = s.y_mm.data() + lane, *z = s.z_mm.data() + lane;
    for (std::size_t i = full; i < p.size; ++i) {
      x[i * kLanes] = p.x_mm[i];
      y[i * kLanes] = p.y_mm[i];
      z[i * kLanes] = p.z_mm[i];
    }
    for (std::size_t i = p.size; i < longest; ++i) {
      x[i * kLanes] = y[i * kLanes] = 0;
      z[i * kLanes] = kPadding_mm;
    }
  }
  return {s.x_mm.data(), s.y_mm.data(), s.z_mm.data(), longest * kLanes};
}

BTMS_INLINE LongLanes count_below(const LanePoints& p, const Lanes& limit) {
  LongLanes n{};
  for (std::size_t i = 0; i < p.size; i += kLanes) n -= load_lanes(p.z_mm + i) < limit;
  return n;
}

// Height of each node's lowest points: the mean of the lowest quarter (1 to 20 points), taken in whole buckets of 32 mm
// above the minimum, so that it is an exact sum of a set that no order can change. Leaves heights relative to it.
BTMS_INLINE Lanes take_datums(const LanePoints& p, const Lanes& count) {
  constexpr int kBuckets = 64, kNearBuckets = 8;
  constexpr double kBucket_mm = 32;
  Lanes lowest = Lanes{} + kPadding_mm;
  for (std::size_t i = 0; i < p.size; i += kLanes) {
    const Lanes z = load_lanes(p.z_mm + i);
    lowest = z < lowest ? z : lowest;
  }
  Lanes wanted = floor_lanes(count * 0.25);
  wanted = wanted > 1.0 ? wanted : Lanes{} + 1.0;
  wanted = wanted < 20.0 ? wanted : Lanes{} + 20.0;
  const LongLanes enough = __builtin_convertvector(wanted, LongLanes);
  // By bisection: the lowest bucket up to which enough points lie, or the last one. Most often it is one of the first.
  const bool near = !any_lane(count_below(p, lowest + kNearBuckets * kBucket_mm) < enough);
  Lanes bucket{};
  for (int half = (near ? kNearBuckets : kBuckets) / 2; half > 0; half /= 2)
    bucket = count_below(p, lowest + (bucket + half) * kBucket_mm) < enough ? bucket + half : bucket;
  const Lanes limit = lowest + (bucket + 1.0) * kBucket_mm;
  Lanes n{}, sum{};
  for (std::size_t i = 0; i < p.size; i += kLanes) {
    const Lanes z = load_lanes(p.z_mm + i);
    const LongLanes taken = z < limit;
    n += taken ? Lanes{} + 1.0 : Lanes{};
    sum += taken ? z - lowest : Lanes{};
  }
  const Lanes datum = lowest + floor_lanes(sum / n);
  for (std::size_t i = 0; i < p.size; i += kLanes) {
    const Lanes z = load_lanes(p.z_mm + i);
    store_lanes(p.z_mm + i, z < kPadding_mm ? clamp_lanes(z - datum, kMaxNodeRelief_mm) : z);
  }
  return datum;
}

// Sums of the points at most `above_mm` over the planes.
template <class Sum>
BTMS_INLINE Moments<Sum> select(const LanePoints& p, const FixedPlanes& plane, double above_mm) {
  const Lanes limit = plane.c + above_mm * kPlaneUnit, one = Lanes{} + 1.0;
  Moments<Sum> m;
  for (std::size_t i = 0; i < p.size; i += kLanes) {
    const Lanes x = load_lanes(p.x_mm + i), y = load_lanes(p.y_mm + i), z = load_lanes(p.z_mm + i);
    m.add(one, x, y, z, z * kPlaneUnit - (plane.a * x + plane.b * y) <= limit);
  }
  return m;
}

// Least-squares planes z = a x + b y + c through the selected points; says for which nodes they determine one.
template <class Sum>
BTMS_INLINE LongLanes fit_planes(const Moments<Sum>& m, FixedPlanes& plane) {
  const Lanes cxx = central(m.n, m.xx, m.x, m.x), cxy = central(m.n, m.xy, m.x, m.y),
              cyy = central(m.n, m.yy, m.y, m.y);
  const Lanes cxz = central(m.n, m.xz, m.x, m.z), cyz = central(m.n, m.yz, m.y, m.z);
  const Lanes det = cxx * cyy - cxy * cxy, n = to_lanes(m.n);
  const LongLanes fitted = (n >= 3.0) & (det > 1e-6 * cxx * cyy);
  const Lanes a = clamp_lanes((cxz * cyy - cyz * cxy) / det, kSteepestFit);
  const Lanes b = clamp_lanes((cyz * cxx - cxz * cxy) / det, kSteepestFit);
  const Lanes c = (to_lanes(m.z) - a * to_lanes(m.x) - b * to_lanes(m.y)) / n;
  // Where there is no plane: one below all points.
  plane.a = fitted ? floor_lanes(a * kPlaneUnit + 0.5) : Lanes{};
  plane.b = fitted ? floor_lanes(b * kPlaneUnit + 0.5) : Lanes{};
  plane.c = fitted ? floor_lanes(c * kPlaneUnit + 0.5) : Lanes{} - kPadding_mm * kPlaneUnit;
  return fitted;
}

// The points the nodes' planes are made of; none where they don't determine a plane.
template <class Sum>
BTMS_INLINE Moments<Sum> robust_selection(const LanePoints& p, const NodeModelRules& rules) {
  Moments<Sum> m = select<Sum>(p, FixedPlanes{}, rules.seed_height_mm);
  for (int i = 0; i < kRefits; ++i) {
    FixedPlanes plane;
    fit_planes(m, plane);
    const Moments<Sum> next = select<Sum>(p, plane, rules.refit_distance_mm);
    const bool settled = !any_lane(~equal(next, m));  // the same points again: further refits repeat
    m = next;
    if (settled) break;
  }
  return m;
}

constexpr double kSmallestPlane_mm2 = 1e-6;   // l1 below 1e-12 m^2: all points in one place
constexpr double kCoordinateNoise_mm2 = 1.0;  // l2 within the rounding of the coordinates: points on a line

template <class Sum>
BTMS_INLINE Moments<Sum> choose(const LanePoints& p, const NodeModelRules& rules) {
  if (rules.model == NodeModel::kRobust) return robust_selection<Sum>(p, rules);
  return select<Sum>(p, FixedPlanes{}, kMaxNodeRelief_mm);  // all points
}

BTMS_INLINE Lanes node_weights(const EigenSystems& e, const NodeModelRules& rules) {
  if (rules.weight == NodeWeight::kNormalized) return (1.0 - e.l3 / e.l1) * ((e.l2 - e.l3) / e.l1);  // Eq 3
  constexpr double kSquareMetre_mm2 = 1e6, kFloor_m4 = 0.001;
  const Lanes l1 = e.l1 / kSquareMetre_mm2, l2 = e.l2 / kSquareMetre_mm2, l3 = e.l3 / kSquareMetre_mm2;
  return (l1 + l2) * l2 / ((l1 * l3 + kFloor_m4) * rules.weight_unit);
}

// Eq 2, 3 and 5 from the chosen points.
template <class Sum>
BTMS_INLINE void finish(const FourPoints& points, const NodeModelRules& rules, const Lanes& datum,
                        const Moments<Sum>& m, Node* four) {
  // Eq 2: planes through the means, normal = eigenvector of the smallest eigenvalue.
  const EigenSystems e = solve_eigen(covariance(m));
  const Lanes n = to_lanes(m.n);
  const LongLanes planar = (n >= 3.0) & (e.l1 >= kSmallestPlane_mm2) & (e.l2 > kCoordinateNoise_mm2);
  const Lanes x = to_lanes(m.x) / n, y = to_lanes(m.y) / n, z = to_lanes(m.z) / n;
  const Lanes weight = node_weights(e, rules), sd = sqrt_lanes(e.l3);
  for (std::size_t t = 0; t < kLanes; ++t) {
    if (points[t].size == 0) continue;
    Node& node = four[t];
    node.node_class = NodeClass::kNoPlane;
    node.count = static_cast<std::uint32_t>(points[t].size);
    node.mean_z_mm = static_cast<std::int32_t>(datum[t]);
    if (!planar[t]) continue;
    node.mean_x_mm = static_cast<std::int16_t>(round_half_up(x[t]));
    node.mean_y_mm = static_cast<std::int16_t>(round_half_up(y[t]));
    node.mean_z_mm += static_cast<std::int32_t>(round_half_up(z[t]));
    set_normal(node, {e.normal_x[t], e.normal_y[t], e.normal_z[t]});
    node.weight = saturate_u16(weight[t] * kWeightUnit);
    node.sd_mm = saturate_u16(sd[t]);
    // Eq 5, read as n >= sigma and s_z >= cos(theta)
    if (node.count >= rules.min_points && normal_xy_squared(node) <= rules.steepest_normal_xy2)
      node.node_class = NodeClass::kCandidate;
  }
}

}  // namespace

std::int32_t steepest_normal_xy2(double slope_max_deg) {
  const double s = sine(radians(slope_max_deg));
  return static_cast<std::int32_t>(std::floor(s * s * (1 << 30)));
}

NodeModelRules::NodeModelRules(const Parameters& p)
    : model(p.node_model),
      weight(p.node_weight),
      weight_unit(4 * p.resolution_m * p.resolution_m * p.resolution_m * p.resolution_m),
      seed_height_mm(static_cast<std::int32_t>(round_half_up(p.seed_height_m * 1000))),
      refit_distance_mm(static_cast<std::int32_t>(round_half_up(p.refit_distance_m * 1000))),
      steepest_normal_xy2(btms::steepest_normal_xy2(p.slope_max_deg)),
      min_points(static_cast<std::uint32_t>(p.min_points)) {}

BTMS_WIDE void model_four(const FourPoints& points, const NodeModelRules& rules, ModelScratch& scratch, Node* four) {
  const LanePoints p = interleave(points, scratch);
  std::fill_n(four, kLanes, Node{});
  if (p.size == 0) return;
  Lanes count{};
  for (std::size_t t = 0; t < kLanes; ++t) count[t] = static_cast<double>(points[t].size);
  const Lanes datum = take_datums(p, count);
  if (p.size <= kExactNodePoints * kLanes)
    finish(points, rules, datum, choose<Lanes>(p, rules), four);
  else
    finish(points, rules, datum, choose<LongLanes>(p, rules), four);
}

}  // namespace btms
