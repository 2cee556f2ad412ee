// One window of a map as rasters, whatever asks for it: a served tile, a submap, a costmap, an exported file.
//
// Squares of level L are 2^L squares of the map wide, anchored at absolute multiples like them. A value is what a query
// at the square's centre answers, as float: on level 0 exactly the root layers of the map's shards, on coarser levels
// the height of the surface at the centre, a lattice corner, and the other layers of the level-0 square north-east of
// it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "engine/model/tile_store.h"

namespace btms {

struct RasterLayer {
  std::string_view name;
  const char* units;                                           // or nullptr
  float (*square)(const TerrainTile& tile, std::size_t cell);  // nullptr: upper_elevation, of a list
};
// elevation first; the names of the root layers of a map.
std::span<const RasterLayer> raster_layers();
// nullptr when there is none of the name.
const RasterLayer* find_raster_layer(std::string_view name);

inline constexpr int kMaxLevel = 20;
inline constexpr std::int64_t kMaxWindowSquares = std::int64_t{1} << 24;  // times layers

struct Window {
  int level = 0;
  CellBox box;  // in squares of the level
  double cell_m = 0;
  std::vector<const RasterLayer*> layers;
  std::vector<std::vector<float>>
      values;  // of every layer: rows x cols from north to south, NaN where there is nothing

  std::size_t rows() const { return static_cast<std::size_t>(box.rows()); }
  std::size_t cols() const { return static_cast<std::size_t>(box.cols()); }
  double min_x_m() const { return box.col0 * cell_m; }
  double min_y_m() const { return box.row0 * cell_m; }
  double max_x_m() const { return box.col1 * cell_m; }
  double max_y_m() const { return box.row1 * cell_m; }
  bool empty() const;  // nothing anywhere
};

// Loads the tiles below, one at a time. Thread-safe as far as `map` is. Throws Error(kUsage) for a level above
// kMaxLevel, an empty box, one beyond the coordinates of maps, or more than kMaxWindowSquares values; what load()
// throws.
Window cut_window(const TileSource& map, int level, const CellBox& box, std::span<const RasterLayer* const> layers);

}  // namespace btms
