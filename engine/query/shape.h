// Discs and polygons, and whether they touch a triangle. Metres, about an origin near the triangle: doubles then are
// exact to a nanometre.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "engine/query/place.h"

namespace btms {

using TrianglePlaces = std::array<Place, 3>;  // counter-clockwise

struct PlaneBox {
  double min_x_m = 0, min_y_m = 0, max_x_m = 0, max_y_m = 0;
};

inline double cross(Place o, Place a, Place b) {
  return (a.x_m - o.x_m) * (b.y_m - o.y_m) - (a.y_m - o.y_m) * (b.x_m - o.x_m);
}

inline bool inside(Place p, const TrianglePlaces& t) {
  return cross(t[0], t[1], p) >= 0 && cross(t[1], t[2], p) >= 0 && cross(t[2], t[0], p) >= 0;
}

inline double distance2(Place p, Place a, Place b) {
  const double dx = b.x_m - a.x_m, dy = b.y_m - a.y_m, length2 = dx * dx + dy * dy;
  const double along = length2 > 0 ? std::clamp(((p.x_m - a.x_m) * dx + (p.y_m - a.y_m) * dy) / length2, 0.0, 1.0) : 0;
  const double x = p.x_m - (a.x_m + along * dx), y = p.y_m - (a.y_m + along * dy);
  return x * x + y * y;
}

inline double distance2(Place p, const TrianglePlaces& t) {
  if (inside(p, t)) return 0;
  return std::min({distance2(p, t[0], t[1]), distance2(p, t[1], t[2]), distance2(p, t[2], t[0])});
}

// Separating axes: those of the triangle's edges and the segment's own.
inline bool touches(Place a, Place b, const TrianglePlaces& t) {
  for (std::size_t i = 0; i < 3; ++i)
    if (cross(t[i], t[(i + 1) % 3], a) < 0 && cross(t[i], t[(i + 1) % 3], b) < 0) return false;
  const double s0 = cross(a, b, t[0]), s1 = cross(a, b, t[1]), s2 = cross(a, b, t[2]);
  if ((s0 > 0 && s1 > 0 && s2 > 0) || (s0 < 0 && s1 < 0 && s2 < 0)) return false;
  const auto apart = [&](double Place::*axis) {
    const auto [low, high] = std::minmax({t[0].*axis, t[1].*axis, t[2].*axis});
    return std::max(a.*axis, b.*axis) < low || std::min(a.*axis, b.*axis) > high;
  };
  return !apart(&Place::x_m) && !apart(&Place::y_m);
}

struct Disc {
  Place centre;
  double radius_m = 0;

  PlaneBox bounds() const {
    return {centre.x_m - radius_m, centre.y_m - radius_m, centre.x_m + radius_m, centre.y_m + radius_m};
  }
  Place middle() const { return centre; }
  // The triangle is about `origin`.
  bool touches(const TrianglePlaces& t, Place origin) const {
    return distance2({centre.x_m - origin.x_m, centre.y_m - origin.y_m}, t) <= radius_m * radius_m;
  }
};

struct Polygon {
  std::span<const Place> corners;  // of a simple polygon, three or more

  PlaneBox bounds() const {
    PlaneBox box{corners[0].x_m, corners[0].y_m, corners[0].x_m, corners[0].y_m};
    for (const Place& p : corners)
      box = {std::min(box.min_x_m, p.x_m), std::min(box.min_y_m, p.y_m), std::max(box.max_x_m, p.x_m),
             std::max(box.max_y_m, p.y_m)};
    return box;
  }
  Place middle() const {
    const PlaneBox box = bounds();
    return {(box.min_x_m + box.max_x_m) / 2, (box.min_y_m + box.max_y_m) / 2};
  }
  // An edge touches it, or it lies wholly inside.
  bool touches(const TrianglePlaces& t, Place origin) const {
    bool inside = false;
    for (std::size_t i = 0, k = corners.size() - 1; i < corners.size(); k = i++) {
      const Place a{corners[i].x_m - origin.x_m, corners[i].y_m - origin.y_m};
      const Place b{corners[k].x_m - origin.x_m, corners[k].y_m - origin.y_m};
      if (btms::touches(a, b, t)) return true;
      if ((a.y_m > t[0].y_m) != (b.y_m > t[0].y_m) &&
          t[0].x_m < (b.x_m - a.x_m) * (t[0].y_m - a.y_m) / (b.y_m - a.y_m) + a.x_m)
        inside = !inside;
    }
    return inside;
  }
};

}  // namespace btms
