// Whether a vehicle may be somewhere: every triangle that shares a point with its footprint, borders included, is held
// against the vehicle's limits. What is compared is the map's layers, for any vehicle; the stored cost belongs to the
// vehicle the map was built for.
//
// Footprints are rounded to the millimetre, overlap is then exact. Checks speak of the terrain: of a bridge's deck, and
// whatever else is above, they know the clearance alone. Thread-safe; in tiles that are in the cache no locks and no
// allocation. Metres and degrees, in the map frame.
//
// A place where no map can be (NaN, infinite) is a place that is not safe. A shape that is none is an error of the
// caller: Error(kUsage) for a radius that is negative or no number, for less than three different vertices, and for
// more work than kMostCheckWork allows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/query/hazard.h"
#include "engine/query/terrain.h"

namespace btms {

struct CheckAnswer {
  bool safe = false;
  double traversability = 0;      // 1 less the greatest share of a limit seen (hazard.h); 0 where not safe
  Hazard hazard = Hazard::kNone;  // the first on the way, then by rows from the south
  Place at;                       // where: centroid of that triangle, or the place that is none
};

inline constexpr std::size_t kMostVertices = 1024;
// Squares of the map in the box around a shape, times its vertices (a disc counts as 4), times poses.
inline constexpr double kMostCheckWork = 1 << 24;

CheckAnswer check_disc(const Terrain& terrain, Place centre, double radius_m, const VehicleLimits& limits);
// A simple polygon, in either order, without holes; where it crosses itself, inside is even-odd.
CheckAnswer check_polygon(const Terrain& terrain, std::span<const Place> polygon, const VehicleLimits& limits);

struct Pose2 {
  Place place;
  double yaw_rad = 0;  // of the vehicle's x axis from east, to the north
};
// `footprint` is about the vehicle's own origin, x ahead, y to the left.
CheckAnswer check_pose(const Terrain& terrain, const Pose2& pose, std::span<const Place> footprint,
                       const VehicleLimits& limits);
// Heading along the path, turning on the spot at its vertices (the shorter way round): poses between which no point of
// the footprint moves further than half the edge of a square. A path of one place is a pose to the east; one without is
// an Error(kUsage).
CheckAnswer check_path(const Terrain& terrain, std::span<const Place> path, std::span<const Place> footprint,
                       const VehicleLimits& limits);
// A disc along the path: all it sweeps.
CheckAnswer check_path(const Terrain& terrain, std::span<const Place> path, double radius_m,
                       const VehicleLimits& limits);

}  // namespace btms
