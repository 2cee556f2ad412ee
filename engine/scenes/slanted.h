// Pulses that come off plumb, as between the strips of an airborne survey: walls and cliffs cast shadows, edges of
// decks let a pulse in below.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "engine/scenes/world.h"

namespace btms {

// Metres to the east for every metre up along the pulse that would meet the ground at x: up to 20 degrees to either
// side, drifting slowly, so that there is no seam between strips.
double slant(double x_m);

// Solid things stop every pulse and have walls down to the ground (a deck: its own thickness).
bool is_solid(const Object& o);
inline constexpr double kDeckThickness_m = 0.9;
// What rises less above the ground is not there.
inline constexpr double kClear_m = 0.03;
// A pulse meets nothing further away from its place on the ground than this.
inline constexpr double kSlantReach_m = 8;

// The absolute height of an object's top; the ground counts for those that follow it.
std::optional<double> absolute_top(const Object& o, double x_m, double y_m, double ground_m);

// A pulse by its place on the ground.
struct Aim {
  double x_m = 0, y_m = 0, ground_m = 0, slant = 0;
  bool decks = true;  // whether decks are in its way
};
// Where it ends before it gets there.
struct Stop {
  double up_m = 0;                 // above the ground aimed at
  const Object* object = nullptr;  // none: the ground, of a cliff
};
// `near` are indices of the solid objects within kSlantReach_m of the place.
std::optional<Stop> stopped(const World& world, std::span<const Object> solids, std::span<const std::uint32_t> near,
                            const Aim& aim);

}  // namespace btms
