// The layers of a tile as floats on any level. Squares of level L are 2^L squares of the map wide, anchored at absolute
// multiples like them. A value is what a query at the square's centre answers: on level 0 what square_layers.h says, on
// coarser levels the height of the surface at the centre, a lattice corner, and the other layers of the level-0 square
// north-east of it.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "engine/model/terrain_tile.h"

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

// The squares of the level whose samples lie in a box of the finest.
CellBox squares_sampled_in(const CellBox& fine, int level);
// The finest square whose values a square of the level has.
Cell sampled(Cell square, int level);

// Height of the surface; NaN where there is none. Precondition: the place is inside the tile.
float elevation_at_m(const TerrainTile& tile, std::int64_t x_mm, std::int64_t y_mm);

// Values of a tile, NaN where there is nothing; lists are brought into a raster once.
class TileSamples {
 public:
  TileSamples(const TerrainTile& tile, std::span<const RasterLayer* const> layers);
  // Of the finest square.
  float of(const RasterLayer& layer, std::size_t cell) const {
    return layer.square ? layer.square(tile_, cell) : upper_[cell];
  }
  // Of a square of the level. Precondition: it is one of squares_sampled_in(tile.box, level).
  float of(const RasterLayer& layer, Cell square, int level) const;

 private:
  const TerrainTile& tile_;
  std::vector<float> upper_;
};

}  // namespace btms
