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
  kGisRoughness,
  kGisStep,
  kGisClearance,
  kGisCost,
  kUpperElevation,
  // Group tgf, the whole model in integers.
  kCornerHeight,
  kCentreHeight,
  kState,
  kWeight,
  kCount,
  kSupport,
  kSd,
  kTerrain,
  kRoughness,
  kStep,
  kClearance,
  kCost,
  kSourceLevel,
  // Group tgf, one value a further surface; only in shards that have any.
  kUpper,
  kUpperHeight,
  kUpperSlopeX,
  kUpperSlopeY,
  kUpperSd,
  kUpperCount,
  kUpperKind,
};

enum class Element : std::uint8_t { kF32, kI32, kI16, kU16, kU8 };
constexpr std::size_t element_bytes(Element e) {
  return e == Element::kU8 ? 1 : e == Element::kU16 || e == Element::kI16 ? 2 : 4;
}

// (y, x), (tri, y, x), (y_corner, x_corner), (upper)
enum class Raster : std::uint8_t { kPerSquare, kPerTriangle, kPerCorner, kPerUpper };
constexpr int dimensions(Raster r) { return r == Raster::kPerTriangle ? 3 : r == Raster::kPerUpper ? 1 : 2; }

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

// Extent of a layer over a box of cells with `upper` further surfaces: planes (4 for triangles, else 1), rows, columns.
// A list is one row.
struct LayerShape {
  std::size_t planes = 1, rows = 0, cols = 0;
  std::size_t elements() const { return planes * rows * cols; }
  friend bool operator==(const LayerShape&, const LayerShape&) = default;
};
LayerShape layer_shape(const LayerInfo& layer, const CellBox& box, std::size_t upper);
// Extent of its chunks: all planes of up to 128 x 128 squares (129 x 129 corners), or 2^16 further surfaces.
LayerShape chunk_shape(const LayerInfo& layer, const CellBox& box, std::size_t upper);

// The layer's raster, little-endian. Not for lists (upper_layers.h).
std::vector<std::uint8_t> gather(const LayerInfo& layer, const TerrainTile& tile);
// The way back, for the rasters in tgf. Precondition: values.size() fits the tile's box. Throws Error(kVerification)
// for a state or a source level there is none of.
void scatter(const LayerInfo& layer, std::span<const std::uint8_t> values, TerrainTile& tile);

}  // namespace btms
