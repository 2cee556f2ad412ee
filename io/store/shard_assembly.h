// Tiles of one shard put together, and cut out again.
#pragma once

#include <utility>
#include <vector>

#include "engine/model/terrain_tile.h"

namespace btms {

using PlacedTile = std::pair<TileId, TerrainTile>;

// One tile over the hull of all. Precondition: no box is empty, at least one tile. Throws Error(kFailed) when two tiles
// disagree about a corner they share: such a map would not be seamless.
TerrainTile assemble(std::vector<PlacedTile>&& tiles);

// The part inside `box`. Precondition: `box` lies inside tile.box.
TerrainTile cut(const TerrainTile& tile, const CellBox& box);

}  // namespace btms
