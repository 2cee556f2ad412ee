#include "engine/query/hazard.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/lattice/plane.h"

namespace btms {
namespace {

// x / limit; 0 / 0 is fine.
double share(double x, double limit) { return x <= 0 ? 0 : x / limit; }

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
    : steepest_rise_mm_(limits.slope_deg >= 90 ? std::numeric_limits<double>::infinity()
                                               : std::tan(limits.slope_deg * std::numbers::pi / 180) * resolution_mm),
      highest_step_mm_(limits.step_m * 1000),
      roughest_mm_(limits.roughness_m * 1000),
      height_mm_(limits.height_m * 1000),
      unknown_is_safe_(limits.unknown_is_safe) {}

HazardRules::Verdict HazardRules::of(const TerrainTile& tile, NodeId id) const {
  const NodeSurface& node = tile.nodes[tile.node_index(id)];
  switch (node.state) {
    case NodeState::kObstacle:
      return {Hazard::kObstacle, 0};
    case NodeState::kUnknown:
      return {unknown_is_safe_ ? Hazard::kNone : Hazard::kUnknown, 0};
    case NodeState::kFilled:
      if (!unknown_is_safe_) return {Hazard::kUnknown, 0};
      break;
    default:
      break;
  }
  const FinalPlane plane = FinalPlane::through(id.triangle, tile.corners_mm(id));
  const double rise_mm = std::sqrt(static_cast<double>(plane.rise2_mm2()));
  if (!(rise_mm <= steepest_rise_mm_)) return {Hazard::kSlope, 0};
  if (!(node.step_mm <= highest_step_mm_)) return {Hazard::kStep, 0};
  if (!(node.roughness_mm <= roughest_mm_)) return {Hazard::kRoughness, 0};
  if (node.clearance_mm != kNothingAbove && !(node.clearance_mm >= height_mm_)) return {Hazard::kClearance, 0};
  return {Hazard::kNone,
          static_cast<float>(std::max({share(rise_mm, steepest_rise_mm_), share(node.step_mm, highest_step_mm_),
                                       share(node.roughness_mm, roughest_mm_)}))};
}

}  // namespace btms
