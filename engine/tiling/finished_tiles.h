// The tiles that leave the engine. A build that follows another makes some of them; the others are those of the map
// before, fetched where a pass looks at them.
#pragma once

#include "engine/tiling/passes.h"
#include "engine/tiling/records.h"

namespace btms {

class FinalTiles {
 public:
  // `made`: the tiles in `tiles` that have been made. `before`: of the map that the build follows, or nullptr.
  FinalTiles(FinishedTiles&& tiles, TileSet&& made, const TileSource* before)
      : values(std::move(tiles)), overturned(made.size()), made_(std::move(made)), here_(made_), before_(before) {}

  FinishedTiles values;
  TileSet overturned;  // tiles not made anew that hold a further surface with another verdict than before

  const TileSet& made() const { return made_; }
  bool is_here(std::size_t i) const { return here_[i] != 0; }
  const TileSource* before() const { return before_; }

  // These tiles are in memory.
  void need(const TileSet& tiles, const PassContext& context) {
    TileSet missing(here_.size());
    for (std::size_t i = 0; i < here_.size(); ++i) missing[i] = tiles[i] && !here_[i];
    if (count(missing) == 0) return;
    context.on(missing).for_each_tile("recall", {writes(values)}, [&](std::size_t i, int) {
      const Tile& tile = context.table.tiles()[i];
      values[i] = TerrainTile(context.table.layout().lattice.resolution_mm(), tile.box);
      if (const auto kept = before_->load(tile.id)) values[i] = *kept;
    });
    add(here_, missing);
  }

 private:
  TileSet made_, here_;
  const TileSource* before_;
};

}  // namespace btms
