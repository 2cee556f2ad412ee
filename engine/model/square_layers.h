// What GIS programs and planners' rasters see: one value a square, derived from the stored integers alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/model/terrain_tile.h"

namespace btms {

// `cell` is the index of the square
// in its tile (TerrainTile::cell_index). NaN where there is nothing. No libm, so equal tiles give equal bits
// everywhere.
// Height of the square's centre corner.
float square_elevation_m(const TerrainTile& tile, std::size_t cell);
// Mean over the triangles that have a surface.
float square_sd_m(const TerrainTile& tile, std::size_t cell);
// The steepest of the triangles that have a surface.
float square_slope_deg(const TerrainTile& tile, std::size_t cell);
// NodeState of the square: obstacle if any triangle is one, else observed if any is, else predicted, else filled, else
// unknown.
std::uint8_t square_class(const TerrainTile& tile, std::size_t cell);
// The greatest of the triangles that have a surface.
float square_roughness_m(const TerrainTile& tile, std::size_t cell);
float square_step_m(const TerrainTile& tile, std::size_t cell);
// The least of the triangles; NaN where nothing was seen above any.
float square_clearance_m(const TerrainTile& tile, std::size_t cell);
// The greatest of the triangles, 0 to 1; NaN where any is not traversable, so that programs that look for the cheapest
// way go round it.
float square_cost(const TerrainTile& tile, std::size_t cell);
// The lowest further surface over the centre of every square.
std::vector<float> upper_elevations_m(const TerrainTile& tile);

// Degrees of the arc tangent of t >= 0, within 1e-6 degrees.
double arctan_deg(double t);

}  // namespace btms
