// Tiles around a place as one revision of the map has them. Immutable: any number of threads may ask the same one.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "io/client/map_client.h"

namespace btms {

using ClientTiles = std::map<TileId, std::shared_ptr<const ClientTile>>;

struct TileSnapshot {
  std::uint64_t number = 0;    // of the snapshots of one FreshTiles, from 1 on; 0: nothing has come yet
  std::uint64_t revision = 0;  // of the map
  TileForm form;
  Place centre;
  double radius_m = 0;
  bool all = false;  // every tile that meets the disc; else those nearest to the centre that the budget has room for
  ClientTiles tiles;

  // Of the square that holds the place; NaN where the map has nothing, or the snapshot has no tile (has()).
  float value(std::size_t layer, Place place) const;
  bool has(Place place) const { return tile(place) != nullptr; }
  const ClientTile* tile(Place place) const;
  std::size_t bytes() const;  // of values
};

// Boxes of the squares that differ between two snapshots, one a tile, in metres. What only one of them looked at
// differs from nothing.
std::vector<BoxM> differences(const TileSnapshot& before, const TileSnapshot& after);

}  // namespace btms
