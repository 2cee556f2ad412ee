// Which squares of a tile take part in the work on a level: all of them for a map; for labels alone, those that the
// surface under a point depends on. What lies elsewhere stays as it is, without planes and outside.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/lattice/tiles.h"
#include "engine/tiling/needy_walk.h"
#include "engine/tiling/ordered_points.h"
#include "engine/tiling/tile_table.h"

namespace btms {

class LevelRegion {
 public:
  // Neighbours in a row: squares, or the lattice corners at their south-western ends.
  struct Run {
    std::int32_t row, col0, col1;
    bool continues(const Run& south) const { return row == south.row + 1 && col0 == south.col0 && col1 == south.col1; }
  };

  explicit LevelRegion(const CellBox& all);
  explicit LevelRegion(const SquareMask& squares);

  // In ascending rows, then columns.
  const std::vector<Run>& squares() const { return squares_; }
  const std::vector<Run>& corners() const { return corners_; }  // of the squares
  std::size_t square_count() const { return square_count_; }

  template <class Fn>
  void for_each_cell(const Fn& fn) const {
    for (const Run& run : squares_)
      for (std::int32_t col = run.col0; col < run.col1; ++col) fn(Cell{col, run.row});
  }
  template <class Fn>
  void for_each_node(const Fn& fn) const {
    for_each_cell([&](Cell c) {
      for (std::uint8_t t = 0; t < kTriangles; ++t) fn(NodeId{c, t});
    });
  }

 private:
  std::vector<Run> squares_, corners_;
  std::size_t square_count_ = 0;
};

using LevelRegions = std::vector<LevelRegion>;  // one a tile of the level's table

LevelRegions whole_tiles(const TileTable& table);

// Level by level, coarsest first, what labels need. `coarsest` has one tile, `rounds` are those of each level.
std::vector<LevelRegions> under_points(const TileTable& coarsest, const OrderedPoints& points,
                                       const std::vector<int>& rounds, const Threads& threads, Progress& progress);

}  // namespace btms
