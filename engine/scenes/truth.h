// What is known of the places in a box of a world.
#pragma once

#include <vector>

#include "engine/scenes/object_grid.h"
#include "engine/scenes/world.h"

namespace btms {

// Immutable, thread-safe. The world must outlive it.
class TruthBox {
 public:
  TruthBox(const World& world, const Box& box);
  // Precondition: the place is in the box; local metres.
  PlaceTruth at(double x_m, double y_m) const;

 private:
  bool hollow(double x_m, double y_m, double ground_m) const;
  bool at_step(double x_m, double y_m, double ground_m) const;

  const World& world_;
  std::vector<Object> solids_, others_;
  ObjectGrid solid_grid_, other_grid_;
};

}  // namespace btms
