// Which squares of a tile want a prediction, and which squares can give one.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/lattice/tiles.h"
#include "engine/tiling/neighbour_index.h"

namespace btms {

// A flag per square of a box, row by row.
struct SquareMask {
  CellBox box;
  std::vector<std::uint8_t> flags;

  explicit SquareMask(const CellBox& b) : box(b), flags(static_cast<std::size_t>(b.cells()), 0) {}
  std::size_t index(std::int32_t col, std::int32_t row) const {
    return static_cast<std::size_t>((std::int64_t{row} - box.row0) * box.cols() + (col - box.col0));
  }
  std::uint8_t& at(std::int32_t col, std::int32_t row) { return flags[index(col, row)]; }
  std::uint8_t at(std::int32_t col, std::int32_t row) const { return flags[index(col, row)]; }
  bool any() const { return std::find(flags.begin(), flags.end(), 1) != flags.end(); }

  // Marks everything within `rings` rings of a marked square: along rows, then along columns.
  SquareMask dilated(std::int32_t rings) const {
    SquareMask wide(box), out(box);
    const auto cols = static_cast<std::int32_t>(box.cols()), rows = static_cast<std::int32_t>(box.rows());
    const auto spread = [rings](const std::uint8_t* from, std::uint8_t* to, std::int32_t n, std::int32_t stride) {
      std::int32_t until = -1;  // marked up to here
      for (std::int32_t i = 0; i < n; ++i) {
        if (i + rings < n && from[static_cast<std::ptrdiff_t>(i + rings) * stride]) until = i + 2 * rings;
        if (i <= until) to[static_cast<std::ptrdiff_t>(i) * stride] = 1;
      }
    };
    // The first `rings` squares of a line are looked at before the line starts.
    const auto spread_all = [&](const std::uint8_t* from, std::uint8_t* to, std::int32_t n, std::int32_t stride) {
      spread(from, to, n, stride);
      for (std::int32_t i = 0; i < std::min(rings, n); ++i)
        if (from[static_cast<std::ptrdiff_t>(i) * stride])
          for (std::int32_t k = 0; k <= std::min(n - 1, i + rings); ++k)
            to[static_cast<std::ptrdiff_t>(k) * stride] = 1;
    };
    for (std::int32_t row = 0; row < rows; ++row)
      spread_all(flags.data() + std::ptrdiff_t{row} * cols, wide.flags.data() + std::ptrdiff_t{row} * cols, cols, 1);
    for (std::int32_t col = 0; col < cols; ++col)
      spread_all(wide.flags.data() + col, out.flags.data() + col, rows, cols);
    return out;
  }
};

// Walks the interior squares that need a prediction, in groups of a few, and for each group the squares that can give
// one.
class NeedyWalk {
 public:
  // `terrain(cell)` and `needs(cell)` look at the four nodes of a square of a TileField; `group` squares each way are a
  // group.
  template <class Field, class Terrain, class Needs>
  NeedyWalk(const Field& nodes, std::int32_t rings, double reach_cells, bool by_lattice, std::int32_t group,
            const Terrain& terrain, const Needs& needs)
      : box_(nodes.interior()), group_(group), needy_(nodes.held()), wanted_(nodes.held()) {
    const CellBox& held = nodes.held();
    SquareMask source(held);
    for (std::int32_t row = held.row0; row < held.row1; ++row)
      for (std::int32_t col = held.col0; col < held.col1; ++col) source.at(col, row) = terrain(nodes.cell({col, row}));
    if (!source.any()) return;
    SquareMask reached = source.dilated(rings);
    for (std::int32_t row = box_.row0; row < box_.row1; ++row)
      for (std::int32_t col = box_.col0; col < box_.col1; ++col)
        needy_.at(col, row) = reached.at(col, row) && needs(nodes.cell({col, row}));
    if (!needy_.any()) return;
    // The index holds only terrain that a needy square can use.
    wanted_ = needy_.dilated(rings);
    for (std::size_t k = 0; k < wanted_.flags.size(); ++k) wanted_.flags[k] &= source.flags[k];
    index_ = by_lattice ? lattice_index(held, wanted_.flags, rings, group)
                        : nanoflann_index(held, wanted_.flags, reach_cells, group);
  }

  bool needy(Cell c) const { return needy_.at(c.col, c.row) != 0; }
  // May be among the squares of a group. Precondition: some square is needy.
  bool wanted(Cell c) const { return wanted_.at(c.col, c.row) != 0; }

  // group(squares that can give a prediction), then each(cell) for every needy square of the group.
  template <class Group, class Each>
  void walk(std::vector<Cell>& squares, const Group& group, const Each& each) {
    if (!index_) return;
    for (std::int32_t row = box_.row0; row < box_.row1; row += group_)
      for (std::int32_t col = box_.col0; col < box_.col1; col += group_) {
        const CellBox here = CellBox{col, row, col + group_, row + group_}.intersect(box_);
        bool any = false;
        for (std::int32_t y = here.row0; y < here.row1; ++y)
          for (std::int32_t x = here.col0; x < here.col1; ++x) any |= needy({x, y});
        if (!any) continue;
        index_->near({col, row}, squares);
        group(squares);
        for (std::int32_t y = here.row0; y < here.row1; ++y)
          for (std::int32_t x = here.col0; x < here.col1; ++x)
            if (needy({x, y})) each(Cell{x, y});
      }
  }

 private:
  CellBox box_;
  std::int32_t group_;
  SquareMask needy_, wanted_;
  std::unique_ptr<NeighbourIndex> index_;
};

}  // namespace btms
