// Heights of a finished model at a place.
#pragma once

#include <cstdint>

#include "engine/model/tile_store.h"

namespace btms {

struct SurfacePoint {
  NodeState state = NodeState::kUnknown;
  double z_m = 0;                // height of the surface; meaningless where state is kUnknown
  double normal[3] = {0, 0, 1};  // unit, z > 0
  double sd_m = 0;               // standard deviation of z
  double weight = 0;             // traversability weight in [0, 1]
  double support = 0;            // kernel support of a prediction
  std::uint32_t count = 0;       // points in the node
};

// The surface at x, y (metres in the map frame, rounded to a millimetre): the plane of the node that holds the place.
// kUnknown outside the map and for non-finite coordinates. Thread-safe as far as `map` is.
SurfacePoint surface_at(const TileSource& map, double x_m, double y_m);

// The same inside one tile, for callers that hold it. Precondition: the tile's box contains the place's cell.
SurfacePoint surface_in(const TerrainTile& tile, std::int64_t x_mm, std::int64_t y_mm);

}  // namespace btms
