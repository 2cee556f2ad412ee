// How finished tiles leave the engine and come back. io/store implements both over HDF5 shards; memory_map.h in memory.
#pragma once

#include <memory>
#include <vector>

#include "engine/lattice/tiles.h"
#include "engine/model/digest.h"
#include "engine/model/terrain_tile.h"

namespace btms {

// Where a map lies on the plane: one lattice, one tile grid.
struct MapLayout {
  Lattice lattice{2000};
  TileGrid grid;
  friend bool operator==(const MapLayout&, const MapLayout&) = default;
};

// Small tiles stay together in square blocks of at least 64 cells: a block has one owner among the ranks and is stored
// in one file.
constexpr std::int32_t block_edge_tiles(const TileGrid& grid) {
  constexpr std::int32_t kBlock_cells = 64;
  return grid.edge_cells >= kBlock_cells ? 1 : (kBlock_cells + grid.edge_cells - 1) / grid.edge_cells;
}
constexpr TileId block_of(const TileGrid& grid, TileId tile) {
  const std::int32_t k = block_edge_tiles(grid);
  return {static_cast<std::int32_t>(floor_div(tile.tx, k)), static_cast<std::int32_t>(floor_div(tile.ty, k))};
}

// Receives finished tiles. Thread-safe; every tile arrives exactly once, in any order.
class TileSink {
 public:
  virtual ~TileSink() = default;
  // Takes the tile and returns its digest. Throws Error(kFailed) when it can't be kept.
  virtual Digest put(TileId id, TerrainTile&& tile) = 0;
  // The same of a tile that is as in the map that is there already. A sink that follows a map can leave it where it is.
  virtual Digest keep(TileId id, const TerrainTile& tile) { return put(id, TerrainTile(tile)); }
};

// Finished tiles of one immutable map revision. Thread-safe.
class TileSource {
 public:
  virtual ~TileSource() = default;
  virtual const MapLayout& layout() const = 0;
  // All tiles that exist, ascending.
  virtual std::vector<TileId> tiles() const = 0;
  // The tile, or nullptr where the map has none. Throws Error(kVerification) when stored bytes are damaged.
  virtual std::shared_ptr<const TerrainTile> load(TileId id) const = 0;
  // The same where only heights, states and thresholds (terrain_mm) are wanted: anything else may have its default.
  virtual std::shared_ptr<const TerrainTile> load_for_labels(TileId id) const { return load(id); }
};

}  // namespace btms
