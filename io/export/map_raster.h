// A part of a map as one raster that need not fit into memory: where it lies, and its windows one by one.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "io/export/raster.h"

namespace btms {

// Squares are whole ones from absolute multiples of their edge, so rasters of one map fit each other.
struct RasterFrame {
  int level = -1;  // -1: squares of their own
  double cell_m = 0;
  CellBox box;  // in squares, rows and columns counted to the north and east

  std::size_t rows() const { return static_cast<std::size_t>(box.rows()); }
  std::size_t cols() const { return static_cast<std::size_t>(box.cols()); }
  // As a window without values.
  Window outline(std::span<const RasterLayer* const> layers) const;
};

// The squares that the box touches (min x, min y, max x, max y in metres), a millionth of a square left aside; without
// a box, all that the map touches. Throws Error(kUsage) for a level or an edge there is none of, a box that is empty,
// or lies where the map is not.
RasterFrame level_frame(const MapReader& map, int level, const std::optional<std::array<double, 4>>& box_m);
RasterFrame square_frame(const MapReader& map, double cell_m, const std::optional<std::array<double, 4>>& box_m);

// Rows from `row0`, counted from the north, and columns from `col0`. Throws as cut_window().
Window read_part(const MapReader& map, const TileSource& tiles, const RasterFrame& frame, std::size_t row0,
                 std::size_t col0, std::size_t rows, std::size_t cols, std::span<const RasterLayer* const> layers);

}  // namespace btms
