// The nearest place where a vehicle may stand.
#pragma once

#include <optional>

#include "engine/query/footprint.h"

namespace btms {

inline constexpr double kMaxNearestSquares = 1024;  // to every side

// Of the centroids of nodes, the one nearest to the place around which a disc of the radius is safe; of equally near
// ones that of the smaller key. Nothing within most_m. Throws Error(kUsage) for a place that is not finite or more than
// kMaxNearestSquares to look at to a side.
std::optional<Place> nearest_traversable(const Terrain& terrain, Place place, double radius_m, double most_m,
                                         const VehicleLimits& limits);

}  // namespace btms
