#include "engine/terrain/node_model.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/terrain/moments.h"
#include "engine/terrain/symmetric_eigen.h"
#include "engine/terrain/trigonometry.h"

namespace btms {
namespace {

// Planes in fixed point for the selection of points: slopes and offset in 2^-12. Below a quarter millimetre over 2 m,
// and the test of a point against it is exact.
constexpr int kPlaneBits = 12;
constexpr double kPlaneUnit = 1 << kPlaneBits;
constexpr double kSteepestFit = 7.9;  // slopes beyond are clamped: they fail Eq 5 anyway
constexpr int kRefits = 3;

struct FixedPlane {
  std::int64_t a = 0, b = 0, c = 0;  // z = (a x + b y + c) / 2^12
};

// Sums of the points at most `above_mm` over the plane; z relative to `datum_mm`, clamped.
Moments select(const NodePoints& p, std::int32_t datum_mm, const FixedPlane& plane, std::int32_t above_mm) {
  const std::int64_t limit = plane.c + (std::int64_t{above_mm} << kPlaneBits);
  Moments m;
  for (std::size_t i = 0; i < p.size; ++i) {
    const std::int64_t x = p.x_mm[i], y = p.y_mm[i];
    const std::int64_t z =
        std::clamp<std::int64_t>(std::int64_t{p.z_mm[i]} - datum_mm, -kMaxNodeRelief_mm, kMaxNodeRelief_mm);
    const std::int64_t keep = -static_cast<std::int64_t>((z << kPlaneBits) - (plane.a * x + plane.b * y) <= limit);
    const std::int64_t kx = x & keep, ky = y & keep, kz = z & keep;
    m.n -= keep;
    m.x += kx;
    m.y += ky;
    m.z += kz;
    m.xx += kx * x;
    m.xy += kx * y;
    m.xz += kx * z;
    m.yy += ky * y;
    m.yz += ky * z;
    m.zz += kz * z;
  }
  return m;
}

// Height of the node's lowest points: the mean of the lowest quarter (1 to 20 points), taken in whole buckets of 32 mm
// above the minimum, so that it is an exact sum of a set that no order can change.
std::int32_t lowest_points_mm(const NodePoints& p) {
  constexpr int kBuckets = 64;
  constexpr int kBucketBits = 5;
  const std::int32_t lowest = *std::min_element(p.z_mm, p.z_mm + p.size);
  std::array<std::uint32_t, kBuckets> count{};
  std::array<std::int64_t, kBuckets> sum{};
  for (std::size_t i = 0; i < p.size; ++i) {
    const std::int64_t above = std::int64_t{p.z_mm[i]} - lowest;
    if (above >= (std::int64_t{kBuckets} << kBucketBits)) continue;
    ++count[static_cast<std::size_t>(above >> kBucketBits)];
    sum[static_cast<std::size_t>(above >> kBucketBits)] += above;
  }
  const std::int64_t wanted = std::clamp<std::int64_t>(static_cast<std::int64_t>(p.size / 4), 1, 20);
  std::int64_t n = 0, total = 0;
  for (std::size_t k = 0; k < kBuckets && n < wanted; ++k) {
    n += count[k];
    total += sum[k];
  }
  return lowest + static_cast<std::int32_t>(total / n);  // both positive: truncation is floor
}

// Least-squares plane z = a x + b y + c through the selected points; false where they don't determine one.
bool fit_plane(const Moments& m, FixedPlane& plane) {
  if (m.n < 3) return false;
  const double cxx = central(m, m.xx, m.x, m.x), cxy = central(m, m.xy, m.x, m.y), cyy = central(m, m.yy, m.y, m.y);
  const double cxz = central(m, m.xz, m.x, m.z), cyz = central(m, m.yz, m.y, m.z);
  const double det = cxx * cyy - cxy * cxy;
  if (!(det > 1e-6 * cxx * cyy)) return false;
  const double a = std::clamp((cxz * cyy - cyz * cxy) / det, -kSteepestFit, kSteepestFit);
  const double b = std::clamp((cyz * cxx - cxz * cxy) / det, -kSteepestFit, kSteepestFit);
  const double c = (static_cast<double>(m.z) - a * static_cast<double>(m.x) - b * static_cast<double>(m.y)) /
                   static_cast<double>(m.n);
  plane.a = static_cast<std::int64_t>(round_half_up(a * kPlaneUnit));
  plane.b = static_cast<std::int64_t>(round_half_up(b * kPlaneUnit));
  plane.c = static_cast<std::int64_t>(round_half_up(c * kPlaneUnit));
  return true;
}

// The points the node's plane is made of. n = 0 where they don't determine a plane.
Moments robust_selection(const NodePoints& p, std::int32_t seed_mm, const NodeModelRules& rules) {
  Moments m = select(p, seed_mm, FixedPlane{}, rules.seed_height_mm);
  for (int i = 0; i < kRefits; ++i) {
    FixedPlane plane;
    if (!fit_plane(m, plane)) return Moments{};
    const Moments next = select(p, seed_mm, plane, rules.refit_distance_mm);
    if (next == m) break;  // the same points again: further refits repeat
    m = next;
  }
  return m;
}

constexpr double kSmallestPlane_mm2 = 1e-6;   // l1 below 1e-12 m^2: all points in one place
constexpr double kCoordinateNoise_mm2 = 1.0;  // l2 within the rounding of the coordinates: points on a line

}  // namespace

std::int32_t steepest_normal_xy2(double slope_max_deg) {
  const double s = sine(radians(slope_max_deg));
  return static_cast<std::int32_t>(std::floor(s * s * (1 << 30)));
}

NodeModelRules::NodeModelRules(const Parameters& p)
    : model(p.node_model),
      seed_height_mm(static_cast<std::int32_t>(round_half_up(p.seed_height_m * 1000))),
      refit_distance_mm(static_cast<std::int32_t>(round_half_up(p.refit_distance_m * 1000))),
      steepest_normal_xy2(btms::steepest_normal_xy2(p.slope_max_deg)),
      min_points(static_cast<std::uint32_t>(p.min_points)) {}

Node model_node(const NodePoints& p, const NodeModelRules& rules) {
  Node node;
  if (p.size == 0) return node;
  node.node_class = NodeClass::kNoPlane;
  node.count = static_cast<std::uint32_t>(std::min<std::size_t>(p.size, 0xffffffffu));
  const std::int32_t datum = lowest_points_mm(p);
  node.mean_z_mm = datum;
  if (p.size < 3) return node;

  Moments m;
  if (rules.model == NodeModel::kRobust) {
    m = robust_selection(p, datum, rules);
  } else {
    m = select(p, datum, FixedPlane{}, kMaxNodeRelief_mm);  // all points
  }
  if (m.n < 3) return node;

  // Eq 2: plane through the mean, normal = eigenvector of the smallest eigenvalue.
  const EigenSystem e = solve_eigen(covariance(m));
  if (e.l1 < kSmallestPlane_mm2 || e.l2 <= kCoordinateNoise_mm2) return node;
  const double n = static_cast<double>(m.n);
  node.mean_x_mm = static_cast<std::int16_t>(round_half_up(static_cast<double>(m.x) / n));
  node.mean_y_mm = static_cast<std::int16_t>(round_half_up(static_cast<double>(m.y) / n));
  node.mean_z_mm = datum + static_cast<std::int32_t>(round_half_up(static_cast<double>(m.z) / n));
  set_normal(node, e.normal);
  // Eq 3
  const double weight = (1 - e.l3 / e.l1) * ((e.l2 - e.l3) / e.l1);
  node.weight = saturate_u16(weight * kWeightUnit);
  node.sd_mm = saturate_u16(std::sqrt(e.l3));
  // Eq 5, read as n >= sigma and s_z >= cos(theta)
  if (node.count >= rules.min_points && normal_xy_squared(node) <= rules.steepest_normal_xy2)
    node.node_class = NodeClass::kCandidate;
  return node;
}

}  // namespace btms
