// Which tiles a pass works on, and which cells hold something else than in the run before: how a build that follows
// another keeps to what has changed. A build without a past works on all tiles, and everything has changed.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/tiling/tile_table.h"

namespace btms {

using TileSet = std::vector<std::uint8_t>;  // a flag per tile of the table

inline void add(TileSet& set, const TileSet& more) {
  for (std::size_t i = 0; i < set.size(); ++i) set[i] |= more[i];
}
inline std::uint64_t count(const TileSet& set) {
  std::uint64_t n = 0;
  for (const std::uint8_t flag : set) n += flag;
  return n;
}

// The cells of a level that have changed: a box per tile, empty where nothing has, and boxes where tiles were and are
// no more. The same on every rank once shared.
struct Changes {
  std::vector<CellBox> boxes;  // by index in the table
  std::vector<CellBox> gone;

  Changes() = default;
  explicit Changes(std::size_t tiles) : boxes(tiles) {}
  static Changes everywhere(const TileTable& table) {
    Changes all;
    for (const Tile& tile : table.tiles()) all.boxes.push_back(tile.box);
    return all;
  }

  void add(const Changes& o) {
    for (std::size_t i = 0; i < boxes.size(); ++i) boxes[i] = boxes[i].hull(o.boxes[i]);
  }
  Changes grown(std::int32_t rings) const {
    Changes out = *this;
    for (CellBox& b : out.boxes) b = b.grown(rings);
    for (CellBox& b : out.gone) b = b.grown(rings);
    return out;
  }
  // On the next finer lattice.
  Changes finer() const {
    const auto twice = [](const CellBox& b) { return CellBox{b.col0 * 2, b.row0 * 2, b.col1 * 2, b.row1 * 2}; };
    Changes out;
    for (const CellBox& b : boxes) out.boxes.push_back(twice(b));
    for (const CellBox& b : gone) out.gone.push_back(twice(b));
    return out;
  }
  // On the lattice this many refinements coarser: every cell that holds some of them.
  Changes coarser(int refinements) const {
    const std::int32_t k = 1 << refinements;
    const auto wide = [&](const CellBox& b) {
      return b.empty() ? CellBox{}
                       : CellBox{static_cast<std::int32_t>(floor_div(b.col0, k)),
                                 static_cast<std::int32_t>(floor_div(b.row0, k)),
                                 static_cast<std::int32_t>(floor_div(b.col1 - 1, k)) + 1,
                                 static_cast<std::int32_t>(floor_div(b.row1 - 1, k)) + 1};
    };
    Changes out;
    for (const CellBox& b : boxes) out.boxes.push_back(wide(b));
    for (const CellBox& b : gone) out.gone.push_back(wide(b));
    return out;
  }
  // Every rank sets the boxes of its own tiles; then all know all.
  void share(Ranks& ranks) {
    if (ranks.size() == 1) return;
    struct Item {
      std::int64_t tile;
      CellBox box;
    };
    std::vector<Item> mine;
    for (std::size_t i = 0; i < boxes.size(); ++i)
      if (!boxes[i].empty()) mine.push_back({static_cast<std::int64_t>(i), boxes[i]});
    for (const Item& item : ranks.gather(mine))
      boxes[static_cast<std::size_t>(item.tile)] = boxes[static_cast<std::size_t>(item.tile)].hull(item.box);
  }
};

// The tiles with cells within `rings` rings of a changed one.
inline TileSet within(const TileTable& table, const Changes& changes, std::int32_t rings) {
  TileSet out(table.tiles().size());
  const auto mark = [&](const CellBox& box) {
    table.for_each_overlap(box.grown(rings), [&](std::size_t i, const CellBox&) { out[i] = 1; });
  };
  for (const CellBox& box : changes.boxes) mark(box);
  for (const CellBox& box : changes.gone) mark(box);
  return out;
}
// The tiles with cells within `rings` rings of one of these tiles.
inline TileSet within(const TileTable& table, const TileSet& tiles, std::int32_t rings) {
  TileSet out = tiles;
  for (std::size_t k = 0; k < tiles.size(); ++k)
    if (tiles[k])
      table.for_each_overlap(table.tiles()[k].box.grown(rings), [&](std::size_t i, const CellBox&) { out[i] = 1; });
  return out;
}

}  // namespace btms
