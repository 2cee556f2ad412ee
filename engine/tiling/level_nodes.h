// The nodes of a level while its rounds go by: of all tiles, or, in a build that follows another, of those that are
// worked on or looked at. The rest is as it was and stays in the records.
#pragma once

#include <vector>

#include "engine/terrain/level_node.h"
#include "engine/tiling/passes.h"
#include "engine/tiling/records.h"

namespace btms {

class LevelNodes {
 public:
  // `context` and `records` outlive it.
  LevelNodes(const PassContext& context, const Records& records, std::int32_t halo);

  TileFields<LevelNode> fields;

  // A round begins: in these tiles nodes are fitted or classified, what else is in memory is of the round before and
  // goes. Tiles of which nothing is in memory are marked in `created`: they are to be created.
  void begin(int round, const TileSet& fit, TileSet& created);
  // Empty nodes.
  void create(std::size_t tile);
  // The nodes of these tiles are in memory: fetches the missing ones from the round's records.
  void need(const TileSet& tiles);

  // After the fit: the cells whose nodes are not those of the record; keeps the new ones. Collective.
  Changes fitted(const TileSet& fit);

  // Whether a node was rejected in the round before the changes; 2 where that isn't known.
  std::uint8_t was_rejected(std::size_t tile, std::size_t node) const {
    return rejected_before_[tile].empty() ? 2 : rejected_before_[tile][node];
  }
  // From here on what need() has fetched, and fetches, is as the record's verdict says; the tiles in `judged` have
  // been given a new one.
  void judged(const TileSet& judged);

 private:
  void fetch(std::size_t i);
  void apply_record(std::size_t i);

  const PassContext& context_;
  const Records& records_;
  std::int32_t halo_;
  int round_ = 0;
  bool judged_ = false;
  TileSet here_;
  std::vector<std::vector<std::uint8_t>> rejected_before_;  // per node of the interior; in builds that follow only
};

// Calls fn(offset in the field, index in the interior, cell) for the cells of an interior, row by row.
template <class Fn>
void for_each_inner(const TileField<LevelNode>& nodes, const Fn& fn) {
  const CellBox& box = nodes.interior();
  std::size_t k = 0;
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for (std::int32_t col = box.col0; col < box.col1; ++col, k += kTriangles)
      fn(nodes.offset({col, row}), k, Cell{col, row});
}

}  // namespace btms
