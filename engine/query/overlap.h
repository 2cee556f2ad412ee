// Which of the four triangles of a square share a point with a shape, borders included. Exact, in integers: bit t of a
// mask is triangle t. Places are millimetres from the square's centre, at most 2^30; h is half the square's edge.
#pragma once

#include <algorithm>
#include <cstdint>

#include "engine/lattice/lattice.h"
#include "engine/query/place.h"

namespace btms {

using TriangleMask = std::uint8_t;
inline constexpr TriangleMask kAllTriangles = 0xF;

// The triangle east of the centre is |y| <= x <= h; the others are that, turned. So distances to it are those to its
// outer side, to a diagonal, or to a corner. `reach` is at most 2^30.
constexpr TriangleMask triangles_on_disc(PlaceMm centre, std::int64_t reach, std::int64_t h) {
  const std::int64_t reach2 = reach * reach;
  if (centre.x * centre.x + centre.y * centre.y <= reach2) return kAllTriangles;  // all have the square's centre
  const auto east = [&](std::int64_t x, std::int64_t y) {
    y = y < 0 ? -y : y;
    if (x < y && x + y <= 0) return false;  // nearest is the square's centre
    if (x < y && x + y <= 2 * h) return (y - x) * (y - x) <= 2 * reach2;
    const std::int64_t dx = std::max<std::int64_t>(x - h, 0), dy = std::max<std::int64_t>(y - h, 0);
    return x < y ? (x - h) * (x - h) + (y - h) * (y - h) <= reach2 : dx * dx + dy * dy <= reach2;
  };
  return static_cast<TriangleMask>(east(centre.x, centre.y) << kEast | east(centre.y, -centre.x) << kNorth |
                                   east(-centre.x, -centre.y) << kWest | east(-centre.y, centre.x) << kSouth);
}

// A segment a-b. Two convex shapes are apart when a line along a side of one of them parts them: the square's sides and
// diagonals (x, y, u = x + y, v = x - y), or the segment itself.
constexpr TriangleMask triangles_on_segment(PlaceMm a, PlaceMm b, std::int64_t h) {
  if (std::max(a.x, b.x) < -h || std::min(a.x, b.x) > h || std::max(a.y, b.y) < -h || std::min(a.y, b.y) > h) return 0;
  const std::int64_t dx = b.x - a.x, dy = b.y - a.y;
  // Twice the area of the triangle the segment spans with the square's centre, and how that changes to the corners.
  const std::int64_t m = dy * a.x - dx * a.y, down = h * (dy - dx), up = h * (dy + dx);
  const auto parts = [&](std::int64_t p, std::int64_t q) {  // the segment's line, off the triangle m, p, q
    return (m > 0 && p > 0 && q > 0) || (m < 0 && p < 0 && q < 0);
  };
  const std::int64_t south_west = m + down, south_east = m - up, north_east = m - down, north_west = m + up;
  const auto [u0, u1] = std::minmax({a.x + a.y, b.x + b.y});
  const auto [v0, v1] = std::minmax({a.x - a.y, b.x - b.y});
  return static_cast<TriangleMask>((u1 >= 0 && v1 >= 0 && !parts(south_east, north_east)) << kEast |
                                   (u1 >= 0 && v0 <= 0 && !parts(north_east, north_west)) << kNorth |
                                   (u0 <= 0 && v0 <= 0 && !parts(north_west, south_west)) << kWest |
                                   (u0 <= 0 && v1 >= 0 && !parts(south_west, south_east)) << kSouth);
}

// A simple polygon with everything inside, of any orientation; where it crosses itself, inside is even-odd. `at(i)` are
// its vertices.
template <class At>
constexpr TriangleMask triangles_on_polygon(std::size_t vertices, const At& at, std::int64_t h) {
  TriangleMask mask = 0;
  bool inside = false;  // the square's centre
  PlaceMm a = at(vertices - 1);
  for (std::size_t i = 0; i < vertices; ++i) {
    const PlaceMm b = at(i);
    mask |= triangles_on_segment(a, b, h);
    if ((a.y > 0) != (b.y > 0)) inside ^= (b.x * a.y - a.x * b.y > 0) == (a.y > b.y);
    a = b;
  }
  return inside ? kAllTriangles : mask;
}

}  // namespace btms
