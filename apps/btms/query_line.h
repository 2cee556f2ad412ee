// What `btms query` prints of places that make a line: heights along it, and whether a vehicle may go there.
#pragma once

#include <span>

#include "engine/query/footprint.h"

namespace btms {

// A line a point, or with `json` one object {"profile": [[distance, z, state], ...]}.
void print_profile(const Terrain& terrain, std::span<const Place> line, double step_m, bool json);

// A vehicle of `length_m` by `width_m`, about its middle. One line, or with `json` one object.
void print_check(const Terrain& terrain, std::span<const Place> line, double length_m, double width_m,
                 const VehicleLimits& limits, bool json);

}  // namespace btms
