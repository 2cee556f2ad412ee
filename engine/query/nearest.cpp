#include "engine/query/nearest.h"

#include <cmath>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"

namespace btms {

std::optional<Place> nearest_traversable(const Terrain& terrain, Place place, double radius_m, double most_m,
                                         const VehicleLimits& limits) {
  const Lattice lattice = terrain.layout().lattice;
  const double r_m = lattice.resolution_m();
  constexpr double kLimit_m = static_cast<double>(kMaxHorizontal_mm) / 2000;
  if (!(std::abs(place.x_m) <= kLimit_m && std::abs(place.y_m) <= kLimit_m))
    throw Error(ErrorCode::kUsage, "the place is no place of a map");
  if (!(most_m >= 0 && most_m <= kMaxNearestSquares * r_m))
    throw Error(ErrorCode::kUsage,
                "the greatest distance is at most " + std::to_string(kMaxNearestSquares * r_m) + " m");
  const auto mm = [](double m) { return static_cast<std::int64_t>(std::floor(m * 1000 + 0.5)); };
  const Cell own = lattice.cell_at(mm(place.x_m), mm(place.y_m));

  std::optional<Place> best;
  double best2 = most_m * most_m;
  NodeId best_id;
  const auto look = [&](Cell cell) {
    const double x_m = static_cast<double>(lattice.centre_x_mm(cell)) / 1000;
    const double y_m = static_cast<double>(lattice.centre_y_mm(cell)) / 1000;
    for (std::uint8_t t = 0; t < kTriangles; ++t) {
      const Place centroid{x_m + (t == kEast   ? r_m / 3
                                  : t == kWest ? -r_m / 3
                                               : 0),
                           y_m + (t == kNorth   ? r_m / 3
                                  : t == kSouth ? -r_m / 3
                                                : 0)};
      const double dx = centroid.x_m - place.x_m, dy = centroid.y_m - place.y_m, distance2 = dx * dx + dy * dy;
      const NodeId id{cell, t};
      if (distance2 > best2 || (best && distance2 == best2 && !(node_key(id) < node_key(best_id)))) continue;
      if (!check_disc(terrain, centroid, radius_m, limits).safe) continue;
      best = centroid;
      best2 = distance2;
      best_id = id;
    }
  };
  // Squares at ring k are at least (k - 1) r away.
  for (std::int32_t ring = 0;; ++ring) {
    const double least_m = (ring - 1) * r_m;
    if (ring > 0 && least_m * least_m > best2) return best;
    for (std::int32_t d = -ring; d <= ring; ++d) {
      look({own.col + d, own.row - ring});
      if (ring > 0) look({own.col + d, own.row + ring});
      if (std::abs(d) == ring) continue;
      look({own.col - ring, own.row + d});
      look({own.col + ring, own.row + d});
    }
  }
}

}  // namespace btms
