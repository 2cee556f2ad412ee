// The surfaces that a round has left: of all tiles, or, in a build that follows or takes up another, of those that were
// made anew or have been asked for.
#pragma once

#include <optional>

#include "engine/tiling/level_surface.h"
#include "engine/tiling/passes.h"
#include "engine/tiling/records.h"

namespace btms {

class RoundSurfaces {
 public:
  RoundSurfaces() = default;
  // None is there yet.
  RoundSurfaces(const TileTable& table, Pager& pager, int round)
      : table_(table), tiles_(pager, table.tiles().size()), here_(table.tiles().size()), round_(round) {}

  const TileTable& table() const { return *table_; }
  int round() const { return round_; }
  const Surfaces& tiles() const { return tiles_; }
  Surfaces& tiles() { return tiles_; }
  void have(const TileSet& tiles) { add(here_, tiles); }

  // The surfaces of these tiles are in memory: fetches the missing ones from the records.
  void need(const TileSet& tiles, const PassContext& context, const Records& records) {
    TileSet missing(here_.size());
    for (std::size_t i = 0; i < here_.size(); ++i) missing[i] = tiles[i] && !here_[i];
    if (count(missing) == 0) return;
    context.on(missing).for_each_tile("recall", {writes(tiles_)}, [&](std::size_t i, int) {
      const Tile& tile = table_->tiles()[i];
      tiles_[i] = LevelSurface(table_->layout().lattice.resolution_mm(), tile.box);
      const std::size_t corners = tiles_[i].corners.size(), centres = tiles_[i].centres.size();
      records.recall(record_number(round_, Step::kSurface), tile.id, tile.box, tiles_[i].corners, tiles_[i].centres,
                     tiles_[i].source);
      if (tiles_[i].corners.size() != corners || tiles_[i].centres.size() != centres ||
          tiles_[i].source.size() != centres * kTriangles)
        throw Error(ErrorCode::kVerification, "a surface that the map remembers has another size than its tile");
    });
    have(missing);
  }

 private:
  std::optional<TileTable> table_;
  Surfaces tiles_;
  TileSet here_;
  int round_ = -1;
};

// The cells at which two surfaces of a tile differ.
inline CellBox difference(const LevelSurface& a, const LevelSurface& b) {
  CellBox out;
  const auto differ = [](const LevelCorner& x, const LevelCorner& y) {
    return x.z_mm != y.z_mm || x.sd_mm != y.sd_mm || x.disagreement_mm != y.disagreement_mm;
  };
  for (std::int32_t row = a.box.row0; row <= a.box.row1; ++row)
    for (std::int32_t col = a.box.col0; col <= a.box.col1; ++col)
      if (const std::size_t k = a.corner_index({col, row}); differ(a.corners[k], b.corners[k]))
        out = out.hull(CellBox{col - 1, row - 1, col + 1, row + 1}.intersect(a.box));
  for (std::int32_t row = a.box.row0; row < a.box.row1; ++row)
    for (std::int32_t col = a.box.col0; col < a.box.col1; ++col) {
      const std::size_t k = a.cell_index({col, row});
      const auto* source = &a.source[k * kTriangles];
      if (differ(a.centres[k], b.centres[k]) || !std::equal(source, source + kTriangles, &b.source[k * kTriangles]))
        out = out.hull({col, row, col + 1, row + 1});
    }
  return out;
}

}  // namespace btms
