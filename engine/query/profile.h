// Heights along a line.
#pragma once

#include <span>
#include <vector>

#include "engine/query/terrain.h"

namespace btms {

struct ProfilePoint {
  double distance_m = 0;  // along the line, on the plane
  Place place;
  HeightAnswer height;
};

inline constexpr double kMostProfilePoints = 1 << 20;

// The vertices of the line, and the places at multiples of step_m along it (0: none). It stays on the surface it is on:
// the hint for a height is the height before, for the first `z_hint_m`. A vertex that is no place (NaN, infinite) is
// answered as outside; the line goes on behind it, without a way to or from it. Thread-safe. Throws Error(kUsage) for a
// step that is neither 0 nor at least a millimetre, and for more than kMostProfilePoints.
std::vector<ProfilePoint> profile(const Terrain& terrain, std::span<const Place> line, double step_m,
                                  double z_hint_m = kNoHint);

}  // namespace btms
