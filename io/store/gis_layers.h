// What GIS programs see: one value a square, derived from the stored integers alone. `cell` is the index of the square
// in its tile (TerrainTile::cell_index). NaN where there is nothing. No libm, so equal tiles give equal bits
// everywhere.
#pragma once

#include <cstddef>
#include <cstdint>

#include "engine/model/terrain_tile.h"

namespace btms {

// Height of the square's centre corner.
float square_elevation_m(const TerrainTile& tile, std::size_t cell);
// Mean over the triangles that have a surface.
float square_sd_m(const TerrainTile& tile, std::size_t cell);
// The steepest of the triangles that have a surface.
float square_slope_deg(const TerrainTile& tile, std::size_t cell);
// NodeState of the square: obstacle if any triangle is one, else observed if any is, else predicted, else unknown.
std::uint8_t square_class(const TerrainTile& tile, std::size_t cell);

// Degrees of the arc tangent of t >= 0, within 1e-6 degrees.
double arctan_deg(double t);

}  // namespace btms
