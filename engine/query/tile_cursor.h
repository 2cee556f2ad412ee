// The tiles under squares asked for one after another: they come along paths and in windows, so the tile of the one
// before is mostly theirs, too.
#pragma once

#include "engine/query/tile_cache.h"

namespace btms {

// For one thread and one query: it keeps the last tile pinned.
class TileCursor {
 public:
  explicit TileCursor(const TileCache& tiles) : tiles_(tiles) {}

  // nullptr where the map is not there, or where its tile can't be read: damaged() then says so.
  const TerrainTile* at(Cell cell) noexcept {
    if (!box_.contains(cell)) {
      const TileGrid& grid = tiles_.layout().grid;
      const TileId id = grid.tile_of(cell);
      tile_ = tiles_.try_pin(id);
      box_ = grid.box_of(id);
    }
    return tile_ && tile_->box.contains(cell) ? tile_.get() : nullptr;
  }
  bool damaged() const { return tile_.damaged(); }

 private:
  const TileCache& tiles_;
  TileCache::Pin tile_;
  CellBox box_;  // of the tile, whole
};

}  // namespace btms
