#include "engine/query/nearest.h"

#include <cmath>

#include "engine/error.h"

namespace btms {
namespace {

// The squares `ring` rows or columns away from one.
template <class Fn>
void for_each_square(Cell middle, std::int32_t ring, const Fn& fn) {
  for (std::int32_t row = -ring; row <= ring; ++row) {
    const std::int32_t step = std::abs(row) == ring ? 1 : 2 * ring;
    for (std::int32_t col = -ring; col <= ring; col += step) fn(Cell{middle.col + col, middle.row + row});
  }
}

}  // namespace

std::optional<Place> nearest_traversable(const Terrain& terrain, Place place, double radius_m, double most_m,
                                         const VehicleLimits& limits) {
  const Lattice lattice = terrain.layout().lattice;
  const std::int64_t r_mm = lattice.resolution_mm();
  const double across = 2 * most_m / lattice.resolution_m() + 3, disc = 2 * radius_m / lattice.resolution_m() + 3;
  if (!(most_m >= 0) || !(16 * across * across * disc * disc <= kMostCheckWork))
    throw Error(ErrorCode::kUsage, "the distance to search for a traversable place is negative, or too far");
  if (!on_plane(place)) return {};
  if (check_disc(terrain, place, radius_m, limits).safe) return place;

  const PlaceMm from = to_mm(place);
  const Cell middle = lattice.cell_at(from.x, from.y);
  std::optional<Place> nearest;
  std::int64_t nearest2 = to_mm(most_m) * to_mm(most_m) + 1;  // square of the distance to beat
  // What lies in a ring is further away than the rings inside it are wide.
  for (std::int32_t ring = 0; ring == 0 || (ring - 1) * r_mm * (ring - 1) * r_mm < nearest2; ++ring)
    for_each_square(middle, ring, [&](Cell cell) {
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const PlaceMm at{lattice.centre_x_mm(cell) + floor_div(centroid_x3(t, r_mm), 3),
                         lattice.centre_y_mm(cell) + floor_div(centroid_y3(t, r_mm), 3)};
        const std::int64_t dx = at.x - from.x, dy = at.y - from.y, distance2 = dx * dx + dy * dy;
        if (distance2 >= nearest2) continue;
        const Place candidate{static_cast<double>(at.x) / 1000, static_cast<double>(at.y) / 1000};
        if (!check_disc(terrain, candidate, radius_m, limits).safe) continue;
        nearest = candidate;
        nearest2 = distance2;
      }
    });
  return nearest;
}

}  // namespace btms
