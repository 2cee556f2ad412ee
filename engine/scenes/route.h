// Where a vehicle can drive in a world.
#pragma once

#include <vector>

#include "engine/scenes/world.h"

namespace btms {

// The height of what carries a vehicle: a street, on its bridges too, or the bare ground.
double support_m(const World& world, double x_m, double y_m);

// A closed path of places a few decimetres apart, in local metres, within the area and within 400 m of its middle. It
// keeps a vehicle's half width away from everything solid and off steps and slopes above 45 degrees, through leaves
// only where there is no other way, on streets where the world has them. A loop round a block or a hill of about 0.8
// times the length, so that a drive of that length meets its own beginning; where no loop is found, as in a corridor,
// there and back again. Throws Error(kUsage) where there is no room to drive.
std::vector<ScenePlace> plan_route(const World& world, const Box& area, double length_m);

}  // namespace btms
