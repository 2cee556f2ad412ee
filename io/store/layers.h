// The layers of a shard: one table that names them, and the way between a TerrainTile and their rasters.
//
// Rasters run from north to south (row 0 is the northernmost), the order GIS programs like; TerrainTile rows run the
// other way.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/model/terrain_tile.h"

namespace btms {

enum class LayerId : std::uint8_t {
  // Root, one value a square, for GIS.
  kElevation,
  kElevationSd,
  kSlope,
  kClass,
  // Group tgf, the whole model in integers.
  kCornerHeight,
  kCentreHeight,
  kState,
  kWeight,
  kCount,
  kSupport,
  kSd,
};

enum class Element : std::uint8_t { kF32, kI32, kU16, kU8 };
constexpr std::size_t element_bytes(Element e) { return e == Element::kU8 ? 1 : e == Element::kU16 ? 2 : 4; }

enum class Raster : std::uint8_t { kPerSquare, kPerTriangle, kPerCorner };  // (y, x), (tri, y, x), (y_corner, x_corner)

struct LayerInfo {
  LayerId id;
  const char* name;
  bool in_tgf;
  Raster raster;
  Element element;
  double scale;       // value in `units` = stored integer * scale; 0 for plain values
  const char* units;  // or nullptr
  const char* long_name;
  bool marks_missing;  // has a _FillValue; else unwritten places are 0
};

std::span<const LayerInfo> layer_table();

// Bytes of one element as HDF5 wants its fill value, and equal to _FillValue where there is one.
std::vector<std::uint8_t> fill_value(const LayerInfo& layer);

// Extent of a layer over a box of cells: planes (4 for triangles, else 1), rows, columns.
struct LayerShape {
  std::size_t planes = 1, rows = 0, cols = 0;
  std::size_t elements() const { return planes * rows * cols; }
};
LayerShape layer_shape(const LayerInfo& layer, const CellBox& box);
// Extent of its chunks: all planes of up to 128 x 128 squares (129 x 129 corners).
LayerShape chunk_shape(const LayerInfo& layer, const CellBox& box);

// The layer's raster, little-endian.
std::vector<std::uint8_t> gather(const LayerInfo& layer, const TerrainTile& tile);
// The way back, for the layers in tgf. Precondition: values.size() fits the tile's box.
void scatter(const LayerInfo& layer, std::span<const std::uint8_t> values, TerrainTile& tile);

// What GIS programs see: one value a square, derived from the stored integers alone. `cell` is the index of the square
// in its tile (TerrainTile::cell_index). NaN where there is nothing. No libm, so equal tiles give equal bits
// everywhere.
// Height of the square's centre corner.
float square_elevation_m(const TerrainTile& tile, std::size_t cell);
// Mean over the triangles that have a surface.
float square_sd_m(const TerrainTile& tile, std::size_t cell);
// The steepest of the triangles that have a surface.
float square_slope_deg(const TerrainTile& tile, std::size_t cell);
// NodeState of the square: obstacle if any triangle is one, else observed if any is, else predicted, else unknown.
std::uint8_t square_class(const TerrainTile& tile, std::size_t cell);

// Degrees of the arc tangent of t >= 0, within 1e-6 degrees.
double arctan_deg(double t);

}  // namespace btms
