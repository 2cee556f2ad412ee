// The nearest place where a vehicle may be: what a start or a goal in a wall becomes.
#pragma once

#include <optional>

#include "engine/query/footprint.h"

namespace btms {

// The place itself where check_disc(place, radius_m) is safe there; else, of the centroids of triangles (to the
// millimetre) where it is safe, that with the least distance, up to `most_m`. Nothing where there is none, or where
// `place` is no place. With radius 0 the triangle alone has to be safe. Thread-safe. Throws Error(kUsage) as
// check_disc(), and when the squares within most_m, each with 4 discs, are more than kMostCheckWork.
std::optional<Place> nearest_traversable(const Terrain& terrain, Place place, double radius_m, double most_m,
                                         const VehicleLimits& limits);

}  // namespace btms
