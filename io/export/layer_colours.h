// What colours the nodes of a picture: their state, or the value of a layer.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "engine/model/terrain_tile.h"
#include "io/export/legend.h"
#include "io/export/picture.h"

namespace btms {

struct PictureLayer {
  std::string_view name;
  std::string_view low, high;           // texts at the ends of the ramp; empty without one
  std::vector<LegendEntry> exceptions;  // what is not on the ramp

  // Base colour of a node. Precondition: it has a surface.
  Rgb (*colour)(const TerrainTile& tile, std::size_t cell, std::uint8_t triangle);
};

// The first is the state.
std::span<const PictureLayer> picture_layers();
// Throws Error(kUsage) naming the layers there are.
const PictureLayer& picture_layer(std::string_view name);

// Colour of the ramp, 0 (harmless) to 1; clamped.
Rgb ramp_colour(double share);

}  // namespace btms
