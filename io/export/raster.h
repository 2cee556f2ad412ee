// One window of a map as rasters, whatever asks for it: a served tile, a submap, a costmap, an exported file.
//
// Levels and values are those of engine/model/tile_samples.h: what a query at the square's centre answers, as float; on
// level 0 exactly the root layers of the map's shards.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "engine/model/tile_samples.h"
#include "engine/model/tile_store.h"

namespace btms {

class MapReader;  // io/store/map_store.h

inline constexpr std::int64_t kMaxWindowSquares = std::int64_t{1} << 24;  // times layers

struct Window {
  int level = -1;                               // -1: squares of their own
  double min_x_m = 0, min_y_m = 0, cell_m = 0;  // south-west corner, edge of a square
  std::size_t rows = 0, cols = 0;
  std::vector<const RasterLayer*> layers;
  std::vector<std::vector<float>>
      values;  // of every layer: rows x cols from north to south, NaN where there is nothing

  double max_x_m() const { return min_x_m + static_cast<double>(cols) * cell_m; }
  double max_y_m() const { return min_y_m + static_cast<double>(rows) * cell_m; }
  bool empty() const;  // nothing anywhere
};

// Loads the tiles below, one at a time. Thread-safe as far as `map` is. Throws Error(kUsage) for a level above
// kMaxLevel, an empty box, one beyond the coordinates of maps, or more than kMaxWindowSquares values; what load()
// throws.
Window cut_window(const TileSource& map, int level, const CellBox& box, std::span<const RasterLayer* const> layers);

// The same of a map on disk, whose tiles are `tiles`, with less work where its files allow that: on level 0 of tiles
// that are stored in one piece the wanted layers alone are decoded, on coarse levels the overviews of shards, a
// thousandth of all tiles below.
Window cut_window(const MapReader& map, const TileSource& tiles, int level, const CellBox& box,
                  std::span<const RasterLayer* const> layers);

// Squares of any edge from any corner: elevation is the surface at the square's centre, the others are those of the
// level-0 square that holds it. The same errors; also for an edge that is not above zero.
Window sample_window(const TileSource& map, double min_x_m, double min_y_m, double cell_m, std::size_t rows,
                     std::size_t cols, std::span<const RasterLayer* const> layers);

}  // namespace btms
