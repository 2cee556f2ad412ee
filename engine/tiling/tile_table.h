// Which tiles a map has, how far each reaches, and which rank owns it. The same on every rank.
//
// A rank owns whole blocks of tiles (what a shard holds) that follow each other along a Hilbert curve, so its blocks
// lie together and have a short border, and as many that every rank has about the same work.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "engine/model/tile_store.h"
#include "engine/tiling/point_bins.h"

namespace btms {

struct Tile {
  TileId id;
  CellBox box;  // cells in use: the tile's square cropped to where a point, or a prediction from one, can be
  int owner = 0;
};

class TileTable {
 public:
  // Tiles of all bins that hold points, all owned by rank 0. `reach` is how many rings of cells a prediction may lie
  // away from a point. `refinements`: how many times finer() will be called; blocks are those of the finest level.
  // tile_cells = 0 makes the whole map one tile (or a few, where it is wider than 2^31 mm or 2^21 cells). Throws
  // Error(kUsage) when tiles and halos together hold more than max_nodes, naming the bin furthest out.
  TileTable(std::span<const BinId> occupied, const BinGrid& bins, std::int32_t tile_cells, std::int32_t reach,
            std::uint64_t max_nodes, int refinements = 0);

  // Gives every tile an owner. A bin may be listed more than once; bins without a tile are passed over.
  void share_out(std::span<const OccupiedBin> occupied, int ranks);

  // The same tiles on the next finer lattice.
  TileTable finer() const;

  // Of all tiles, without halos.
  std::uint64_t node_count() const;

  const MapLayout& layout() const { return layout_; }
  const std::vector<Tile>& tiles() const { return tiles_; }  // ascending by id
  // Index in tiles(), or -1 where the map has no tile.
  std::int32_t index_of(TileId id) const {
    const auto it = index_.find(id);
    return it == index_.end() ? -1 : it->second;
  }
  // Who computes the nodes of a bin that holds points: the owner of the tile at its south-west corner.
  int owner_of(BinId bin) const { return tiles_[static_cast<std::size_t>(tile_of(bin))].owner; }
  // Calls fn(index, box) for every tile with cells in `box`, with the part of the box it holds.
  template <class Fn>
  void for_each_overlap(const CellBox& box, Fn&& fn) const {
    layout_.grid.for_each_tile(box, [&](TileId id) {
      const std::int32_t i = index_of(id);
      if (i < 0) return;
      const CellBox part = box.intersect(tiles_[static_cast<std::size_t>(i)].box);
      if (!part.empty()) fn(static_cast<std::size_t>(i), part);
    });
  }

 private:
  std::int32_t tile_of(BinId bin) const;

  BinGrid bins_;
  MapLayout layout_;
  int refinements_;
  std::vector<Tile> tiles_;
  std::unordered_map<TileId, std::int32_t, TileIdHash> index_;
};

}  // namespace btms
