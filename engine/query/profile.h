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

inline constexpr std::size_t kMaxProfilePoints = 1'000'000;

// At the line's own places, and every step_m between them (0: there only). It stays on the surface it is on: every
// height is the one nearest to that before, the first the one nearest to z_hint_m. Throws Error(kUsage) for more than
// kMaxProfilePoints, a step below zero, a line without places or with ones that are not finite.
std::vector<ProfilePoint> profile(const Terrain& terrain, std::span<const Place> line, double step_m,
                                  double z_hint_m = kNoHint);

}  // namespace btms
