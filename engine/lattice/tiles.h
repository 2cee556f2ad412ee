// Boxes of cells and the tile grid that cuts a map into them. Tiles overlap in nodes (their halo), never in points.
#pragma once

#include <algorithm>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "engine/lattice/lattice.h"

namespace btms {

// Half-open box of cells: [col0, col1) x [row0, row1). Empty boxes are all equal in meaning (cells() == 0).
struct CellBox {
  std::int32_t col0 = 0, row0 = 0, col1 = 0, row1 = 0;
  friend constexpr auto operator<=>(const CellBox&, const CellBox&) = default;

  constexpr std::int64_t cols() const { return col1 > col0 ? std::int64_t{col1} - col0 : 0; }
  constexpr std::int64_t rows() const { return row1 > row0 ? std::int64_t{row1} - row0 : 0; }
  constexpr std::int64_t cells() const { return cols() * rows(); }
  constexpr bool empty() const { return col1 <= col0 || row1 <= row0; }
  constexpr bool contains(Cell c) const { return c.col >= col0 && c.col < col1 && c.row >= row0 && c.row < row1; }

  // The box with `rings` more cells on every side (its halo included).
  constexpr CellBox grown(std::int32_t rings) const {
    return empty() ? CellBox{} : CellBox{col0 - rings, row0 - rings, col1 + rings, row1 + rings};
  }
  constexpr CellBox intersect(const CellBox& o) const {
    const CellBox b{std::max(col0, o.col0), std::max(row0, o.row0), std::min(col1, o.col1), std::min(row1, o.row1)};
    return b.empty() ? CellBox{} : b;
  }
  // Smallest box that holds both.
  constexpr CellBox hull(const CellBox& o) const {
    if (empty()) return o;
    if (o.empty()) return *this;
    return {std::min(col0, o.col0), std::min(row0, o.row0), std::max(col1, o.col1), std::max(row1, o.row1)};
  }
};

struct TileId {
  std::int32_t tx = 0;  // column of tiles
  std::int32_t ty = 0;  // row of tiles
  friend constexpr auto operator<=>(const TileId&, const TileId&) = default;
};

struct TileIdHash {
  std::size_t operator()(TileId t) const {
    return (static_cast<std::size_t>(static_cast<std::uint32_t>(t.tx)) * 0x9E3779B97F4A7C15ull) ^
           (static_cast<std::size_t>(static_cast<std::uint32_t>(t.ty)) * 0xC2B2AE3D27D4EB4Full);
  }
};

// Tiles are squares of edge_cells cells, anchored at `origin` (cell {0,0} unless the whole map is one tile).
struct TileGrid {
  std::int32_t edge_cells = 128;
  Cell origin{};
  friend constexpr bool operator==(const TileGrid&, const TileGrid&) = default;

  constexpr TileId tile_of(Cell c) const {
    return {static_cast<std::int32_t>(floor_div(std::int64_t{c.col} - origin.col, edge_cells)),
            static_cast<std::int32_t>(floor_div(std::int64_t{c.row} - origin.row, edge_cells))};
  }
  constexpr CellBox box_of(TileId t) const {
    const std::int64_t c = std::int64_t{t.tx} * edge_cells + origin.col,
                       r = std::int64_t{t.ty} * edge_cells + origin.row;
    return {static_cast<std::int32_t>(c), static_cast<std::int32_t>(r), static_cast<std::int32_t>(c + edge_cells),
            static_cast<std::int32_t>(r + edge_cells)};
  }
  // Calls fn(TileId) for every tile that overlaps the box, row by row.
  template <class Fn>
  constexpr void for_each_tile(const CellBox& box, Fn&& fn) const {
    if (box.empty()) return;
    const TileId lo = tile_of({box.col0, box.row0}), hi = tile_of({box.col1 - 1, box.row1 - 1});
    for (std::int32_t ty = lo.ty; ty <= hi.ty; ++ty)
      for (std::int32_t tx = lo.tx; tx <= hi.tx; ++tx) fn(TileId{tx, ty});
  }
};

}  // namespace btms
