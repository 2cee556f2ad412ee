#include "engine/query/hazard.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/lattice/plane.h"
#include "engine/trigonometry.h"

namespace btms {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double share_of(double value, double limit) {
  if (!(limit >= 0)) return kInfinity;
  return value == 0 ? 0 : value / limit;
}

double rise_mm(double slope_deg, double r_mm) {
  if (!(slope_deg >= 0)) return slope_deg;
  return slope_deg >= 90 ? kInfinity : r_mm * sine(radians(slope_deg)) / cosine(radians(slope_deg));
}

}  // namespace

VehicleLimits limits_of(const Parameters& p) {
  VehicleLimits limits;
  limits.slope_deg = p.vehicle_max_slope_deg;
  limits.step_m = p.vehicle_max_step_m;
  limits.height_m = p.vehicle_height_m;
  return limits;
}

const char* hazard_name(Hazard hazard) {
  switch (hazard) {
    case Hazard::kSlope:
      return "slope";
    case Hazard::kStep:
      return "step";
    case Hazard::kRoughness:
      return "roughness";
    case Hazard::kClearance:
      return "clearance";
    case Hazard::kObstacle:
      return "obstacle";
    case Hazard::kUnknown:
      return "unknown";
    case Hazard::kOutside:
      return "outside";
    case Hazard::kDamaged:
      return "damaged";
    case Hazard::kNone:
      break;
  }
  return "none";
}

HazardRules::HazardRules(const VehicleLimits& limits, std::int32_t resolution_mm)
    : steepest_rise_mm_(rise_mm(limits.slope_deg, resolution_mm)),
      highest_step_mm_(limits.step_m * 1000),
      roughest_mm_(limits.roughness_m * 1000),
      height_mm_(limits.height_m * 1000),
      unknown_is_safe_(limits.unknown_is_safe),
      predicted_is_safe_(limits.predicted_is_safe) {}

HazardRules::Verdict HazardRules::of(const TerrainTile& tile, NodeId id) const {
  const NodeSurface& node = tile.nodes[tile.node_index(id)];
  if (node.state == NodeState::kObstacle) return {Hazard::kObstacle};
  if (node.state == NodeState::kUnknown || node.state == NodeState::kFilled ||
      (node.state == NodeState::kPredicted && !predicted_is_safe_))
    return {unknown_is_safe_ ? Hazard::kNone : Hazard::kUnknown};
  const FinalPlane plane = FinalPlane::through(id.triangle, tile.corners_mm(id));
  const double slope = share_of(std::sqrt(static_cast<double>(plane.rise2_mm2())), steepest_rise_mm_);
  if (!(slope <= 1)) return {Hazard::kSlope};
  const double step = share_of(node.step_mm, highest_step_mm_);
  if (!(step <= 1)) return {Hazard::kStep};
  const double rough = roughest_mm_ == kInfinity ? std::min(1.0, share_of(2 * node.roughness_mm, highest_step_mm_))
                                                 : share_of(node.roughness_mm, roughest_mm_);
  if (!(rough <= 1)) return {Hazard::kRoughness};
  if (!(height_mm_ >= 0) || (node.clearance_mm != kNothingAbove && node.clearance_mm < height_mm_))
    return {Hazard::kClearance};
  return {Hazard::kNone, std::max({slope, step, rough})};
}

}  // namespace btms
