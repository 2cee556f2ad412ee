// Colours of the relief: how a plane of the surface looks in the light of a low sun in the north-west.
#pragma once

#include <cstdint>

#include "engine/model/terrain_tile.h"
#include "io/export/picture.h"

namespace btms {

// Slope of a node's plane: rise per run to the east and to the north.
struct Gradient {
  double east = 0, north = 0;
};
// Precondition: the node has a surface.
Gradient node_gradient(const TerrainTile& tile, std::size_t cell, std::uint8_t triangle);

// Base colour of a state, as the legend shows it.
Rgb state_colour(NodeState state);

// A base colour in the light; slopes are exaggerated by `relief` first.
Rgb shaded(Rgb base, Gradient gradient, double relief);

}  // namespace btms
