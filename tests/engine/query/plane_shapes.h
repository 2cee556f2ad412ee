// Overlap in the plane the long way: orientations, segments, distances. Exact for small integers.
#pragma once

#include <array>
#include <vector>

#include "engine/lattice/lattice.h"
#include "engine/query/place.h"

namespace btms::test {

inline std::int64_t side(PlaceMm a, PlaceMm b, PlaceMm p) {
  return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
}
inline bool in_box_of(PlaceMm a, PlaceMm b, PlaceMm p) {
  return std::min(a.x, b.x) <= p.x && p.x <= std::max(a.x, b.x) && std::min(a.y, b.y) <= p.y &&
         p.y <= std::max(a.y, b.y);
}
inline bool on_segment(PlaceMm a, PlaceMm b, PlaceMm p) { return side(a, b, p) == 0 && in_box_of(a, b, p); }
inline bool segments_meet(PlaceMm a, PlaceMm b, PlaceMm c, PlaceMm d) {
  if (on_segment(a, b, c) || on_segment(a, b, d) || on_segment(c, d, a) || on_segment(c, d, b)) return true;
  const auto sign = [](std::int64_t v) { return (v > 0) - (v < 0); };
  return sign(side(a, b, c)) * sign(side(a, b, d)) < 0 && sign(side(c, d, a)) * sign(side(c, d, b)) < 0;
}
// Border included.
inline bool in_polygon(const std::vector<PlaceMm>& polygon, PlaceMm p) {
  bool inside = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const PlaceMm a = polygon[i], b = polygon[(i + 1) % polygon.size()];
    if (on_segment(a, b, p)) return true;
    if (a.y <= p.y && b.y > p.y && side(a, b, p) > 0) inside = !inside;
    if (b.y <= p.y && a.y > p.y && side(a, b, p) < 0) inside = !inside;
  }
  return inside;
}
inline bool polygons_meet(const std::vector<PlaceMm>& p, const std::vector<PlaceMm>& q) {
  if (in_polygon(p, q[0]) || in_polygon(q, p[0])) return true;
  for (std::size_t i = 0; i < p.size(); ++i)
    for (std::size_t j = 0; j < q.size(); ++j)
      if (segments_meet(p[i], p[(i + 1) % p.size()], q[j], q[(j + 1) % q.size()])) return true;
  return false;
}
inline bool within(PlaceMm a, PlaceMm b, PlaceMm p, std::int64_t reach) {  // of the segment ab
  const std::int64_t dx = b.x - a.x, dy = b.y - a.y, length2 = dx * dx + dy * dy;
  const std::int64_t along = (p.x - a.x) * dx + (p.y - a.y) * dy;
  const auto square = [](PlaceMm from, PlaceMm to) {
    return (to.x - from.x) * (to.x - from.x) + (to.y - from.y) * (to.y - from.y);
  };
  if (along <= 0) return square(a, p) <= reach * reach;
  if (along >= length2) return square(b, p) <= reach * reach;
  return side(a, b, p) * side(a, b, p) <= reach * reach * length2;
}
inline bool disc_meets(const std::vector<PlaceMm>& polygon, PlaceMm centre, std::int64_t reach) {
  if (in_polygon(polygon, centre)) return true;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    if (within(polygon[i], polygon[(i + 1) % polygon.size()], centre, reach)) return true;
  return false;
}

// A triangle of the square of edge 2h about a centre.
inline std::vector<PlaceMm> triangle(std::uint8_t t, PlaceMm centre, std::int64_t h) {
  std::vector<PlaceMm> corners;
  for (const HalfCell c : triangle_corners(t)) corners.push_back({centre.x + (c.x - 1) * h, centre.y + (c.y - 1) * h});
  return corners;
}

}  // namespace btms::test
