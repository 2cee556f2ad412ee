// Whether a vehicle may stand somewhere, or drive along: every node that the ground below it touches is looked at.
#pragma once

#include <span>
#include <vector>

#include "engine/query/hazard.h"
#include "engine/query/terrain.h"

namespace btms {

struct CheckAnswer {
  bool safe = false;
  double traversability = 0;      // 1 minus the worst share of a limit, 0 to 1; 0 where it is not safe
  Hazard hazard = Hazard::kNone;  // what is first in the way
  Place at;                       // where: inside the node. Meaningless where nothing is
};

// Squares one check may look at; a larger shape is not safe for what it is: Error(kUsage).
inline constexpr double kMaxCheckSquares = 1 << 20;
inline constexpr std::size_t kMaxCheckPoses = 1 << 20;

// Thread-safe, as Terrain. A node is touched when its triangle and the shape share a place. Of several hazards the one
// nearest to the shape's centre is told. Places that are no numbers are outside. check_disc() does not allocate.
// Throws Error(kUsage) beyond the limits above, or for a polygon of fewer than three places.
CheckAnswer check_disc(const Terrain& terrain, Place centre, double radius_m, const VehicleLimits& limits);
// Any simple polygon, either way round.
CheckAnswer check_polygon(const Terrain& terrain, std::span<const Place> polygon, const VehicleLimits& limits);

// The same along a path, at poses at most half a square apart; the first hazard on the way is told. A disc:
CheckAnswer check_path(const Terrain& terrain, std::span<const Place> path, double radius_m,
                       const VehicleLimits& limits);
// A polygon about the vehicle's own origin, x ahead, which heads along the path and turns at its corners on the spot.
CheckAnswer check_path(const Terrain& terrain, std::span<const Place> path, std::span<const Place> footprint,
                       const VehicleLimits& limits);

}  // namespace btms
