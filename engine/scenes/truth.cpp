#include "engine/scenes/truth.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/scenes/slanted.h"

namespace btms {
namespace {

constexpr double kReach_m = 10;   // of what encloses a hollow
constexpr double kRise_m = 0.4;   // of a hollow's rim
constexpr double kUpper_m = 0.5;  // clearance of a second surface
constexpr double kStep_m = 0.5;   // height of a step, and how near it is
constexpr double kFace_m = 0.125;

std::vector<Object> objects_in(const World& world, const Box& box, bool solid) {
  std::vector<Object> all, some;
  world.place(box, all);
  for (const Object& o : all)
    if (is_solid(o) == solid) some.push_back(o);
  return some;
}

// Of a place below a thing.
Stratum under(const Object& o) {
  switch (o.label) {
    case SceneClass::kBridgeDeck:
      return Stratum::kUnderBridge;
    case SceneClass::kBuilding:
      return Stratum::kUnderBuilding;
    case SceneClass::kLowVegetation:
    case SceneClass::kHighVegetation:
      return Stratum::kUnderPlants;
    default:
      return Stratum::kUnderVehicle;
  }
}

}  // namespace

TruthBox::TruthBox(const World& world, const Box& box)
    : world_(world),
      solids_(objects_in(world, box.grown(kReach_m), true)),
      others_(objects_in(world, box, false)),
      solid_grid_(box, solids_, kReach_m),
      other_grid_(box, others_, 0) {}

PlaceTruth TruthBox::at(double x_m, double y_m) const {
  const double ground = world_.ground_m(x_m, y_m);
  PlaceTruth truth;
  truth.ground_z_m = ground;
  double highest = -std::numeric_limits<double>::infinity();
  const auto visit = [&](const Object& o) {
    if (o.label == SceneClass::kCeiling) return;
    const auto z = absolute_top(o, x_m, y_m, ground);
    if (!z || *z <= ground + kClear_m) return;
    truth.stratum = std::max(truth.stratum, under(o));
    if (o.form == Form::kDeck && *z > ground + kUpper_m) truth.upper_z_m = std::max(truth.upper_z_m.value_or(*z), *z);
    if (*z > highest) {
      highest = *z;
      truth.cover = o.label;
    }
  };
  const auto near = solid_grid_.near(x_m, y_m);
  for (const std::uint32_t i : near) visit(solids_[i]);
  for (const std::uint32_t i : other_grid_.near(x_m, y_m)) visit(others_[i]);
  truth.at_step = at_step(x_m, y_m, ground);

  const bool plants = truth.stratum == Stratum::kUnderPlants;
  if (truth.stratum > Stratum::kUnderPlants) return truth;
  if (!plants && stopped(world_, solids_, near, {x_m, y_m, ground, slant(x_m)}))
    truth.stratum = Stratum::kBehindWall;
  else if (hollow(x_m, y_m, ground))
    truth.stratum = Stratum::kHollow;
  return truth;
}

bool TruthBox::hollow(double x_m, double y_m, double ground_m) const {
  const double diagonal = std::sqrt(0.5);
  const double directions[8][2] = {{1, 0},
                                   {-1, 0},
                                   {0, 1},
                                   {0, -1},
                                   {diagonal, diagonal},
                                   {-diagonal, -diagonal},
                                   {diagonal, -diagonal},
                                   {-diagonal, diagonal}};
  const auto near = solid_grid_.near(x_m, y_m);
  const auto rises = [&](double x, double y) {
    const double ground = world_.ground_m(x, y);
    if (ground > ground_m + kRise_m) return true;
    for (const std::uint32_t i : near) {
      if (solids_[i].label != SceneClass::kBuilding) continue;
      const auto z = absolute_top(solids_[i], x, y, ground);
      if (z && *z > ground_m + kRise_m) return true;
    }
    return false;
  };
  for (const auto& [dx, dy] : directions) {
    bool closed = false;
    for (double d = kReach_m; d > 0.5 && !closed; d -= 1.25) closed = rises(x_m + dx * d, y_m + dy * d);
    if (!closed) return false;
  }
  return true;
}

bool TruthBox::at_step(double x_m, double y_m, double ground_m) const {
  // On a smooth slope both sides cancel; on the face of a wall itself they do too, but that is steep.
  const auto jumps = [&](double dx, double dy) {
    const double d = kStep_m, e = kFace_m;
    const double ahead = world_.ground_m(x_m + dx * d, y_m + dy * d),
                 behind = world_.ground_m(x_m - dx * d, y_m - dy * d);
    if (std::abs(ahead - 2 * ground_m + behind) > kStep_m) return true;
    if (std::abs(ahead - behind) < kStep_m) return false;
    return std::abs(world_.ground_m(x_m + dx * e, y_m + dy * e) - world_.ground_m(x_m - dx * e, y_m - dy * e)) >
           kStep_m;
  };
  return jumps(1, 0) || jumps(0, 1);
}

}  // namespace btms
