// What keeps a described vehicle from a node of the finished surface.
#pragma once

#include <cstdint>
#include <limits>

#include "engine/model/terrain_tile.h"
#include "engine/terrain/parameters.h"

namespace btms {

// Independent of the vehicle that the map's stored costs were made for. A limit that is negative or NaN is exceeded
// everywhere.
struct VehicleLimits {
  double slope_deg = 20;
  double step_m = 0.2;
  double roughness_m = std::numeric_limits<double>::infinity();  // rms
  double height_m = 0;                                           // that has to be free above the surface
  bool unknown_is_safe = false;  // no surface, a guess far from any ground seen, or beyond the map
  bool predicted_is_safe = true;
};
// The vehicle of the map's parameters.
VehicleLimits limits_of(const Parameters& p);

enum class Hazard : std::uint8_t {
  kNone,
  kSlope,
  kStep,
  kRoughness,
  kClearance,
  kObstacle,
  kUnknown,
  kOutside,
  kDamaged
};
const char* hazard_name(Hazard hazard);  // "none", "slope", "step", ...

// The limits, ready to be compared with what tiles store.
class HazardRules {
 public:
  HazardRules(const VehicleLimits& limits, std::int32_t resolution_mm);

  struct Verdict {
    Hazard hazard = Hazard::kNone;
    // Where there is none: the worst of slope, step and roughness, each a share of its limit. Roughness without a limit
    // counts as in the map's costs: twice it over the highest step, at most 1.
    double share = 0;
  };
  // Precondition: the node lies in the tile's box.
  Verdict of(const TerrainTile& tile, NodeId id) const;
  // Of places without a node.
  Verdict outside() const { return {unknown_is_safe_ ? Hazard::kNone : Hazard::kOutside}; }

 private:
  double steepest_rise_mm_;  // over one r
  double highest_step_mm_, roughest_mm_, height_mm_;
  bool unknown_is_safe_, predicted_is_safe_;
};

}  // namespace btms
