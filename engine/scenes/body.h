// Objects as somebody on the ground meets them: with an inside and an underside, not only a top.
#pragma once

#include <optional>
#include <vector>

#include "engine/scenes/world.h"

namespace btms {

enum class Matter : std::uint8_t {
  kSolid,   // from the top down to the ground
  kPlate,   // a deck, a ceiling, a table: `thickness_m` below the top
  kLeaves,  // so far below the top, and rays may pass between them
};

struct Body {
  Object object;
  Matter matter = Matter::kSolid;
  double thickness_m = 0;
};

// Everything that meets the box; trees have trunks.
std::vector<Body> bodies_in(const World& world, const Box& box);

// From the underside to the top of a body at a place, absolute; `ground_m` is the terrain there. None outside of its
// footprint, and where its top does not rise clear of the ground.
struct Extent {
  double low_m, high_m;
};
std::optional<Extent> extent_at(const Body& body, double x_m, double y_m, double ground_m);

// Bounds of that over the whole footprint, for ground between the two heights.
Extent extent_over(const Body& body, const Extent& ground);

}  // namespace btms
