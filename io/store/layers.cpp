#include "io/store/layers.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "engine/error.h"
#include "engine/model/square_layers.h"

namespace btms {
namespace {

static_assert(std::endian::native == std::endian::little, "rasters are stored little-endian");

constexpr std::size_t kChunkCells = 128, kChunkUpper = std::size_t{1} << 16;
constexpr std::uint8_t kCoarsestSource = 5;  // a map has at most 6 levels

constexpr LayerInfo kLayers[] = {
    {LayerId::kElevation, "elevation", false, Raster::kPerSquare, Element::kF32, 0, "m",
     "height of the terrain at the square's centre", true},
    {LayerId::kElevationSd, "elevation_sd", false, Raster::kPerSquare, Element::kF32, 0, "m",
     "standard deviation of the height, mean over the square's triangles", true},
    {LayerId::kSlope, "slope", false, Raster::kPerSquare, Element::kF32, 0, "degree",
     "slope of the steepest of the square's triangles", true},
    {LayerId::kClass, "class", false, Raster::kPerSquare, Element::kU8, 0, nullptr, "kind of terrain", true},
    {LayerId::kGisRoughness, "roughness", false, Raster::kPerSquare, Element::kF32, 0, "m",
     "rms distance of terrain points from the surface, greatest of the square's triangles", true},
    {LayerId::kGisStep, "step", false, Raster::kPerSquare, Element::kF32, 0, "m",
     "jump in height of the ground, greatest of the square's triangles", true},
    {LayerId::kGisClearance, "clearance", false, Raster::kPerSquare, Element::kF32, 0, "m",
     "from the surface up to the lowest thing above it, least of the square's triangles", true},
    {LayerId::kGisCost, "cost", false, Raster::kPerSquare, Element::kF32, 0, "1",
     "cost of crossing, greatest of the square's triangles; missing where one is not traversable", true},
    {LayerId::kUpperElevation, "upper_elevation", false, Raster::kPerSquare, Element::kF32, 0, "m",
     "height of the lowest further surface above the terrain at the square's centre", true},
    {LayerId::kCornerHeight, "corner_height", true, Raster::kPerCorner, Element::kI32, 0.001, "m",
     "height of the surface at the corners of the squares", true},
    {LayerId::kCentreHeight, "centre_height", true, Raster::kPerSquare, Element::kI32, 0.001, "m",
     "height of the surface at the centres of the squares", true},
    {LayerId::kState, "state", true, Raster::kPerTriangle, Element::kU8, 0, nullptr, "kind of terrain", false},
    {LayerId::kWeight, "weight", true, Raster::kPerTriangle, Element::kU8, 1.0 / 255, "1", "traversability weight",
     false},
    {LayerId::kCount, "count", true, Raster::kPerTriangle, Element::kU16, 0, "1", "points, 65535 is that many or more",
     false},
    {LayerId::kSupport, "support", true, Raster::kPerTriangle, Element::kU16, 1.0 / 256, "1",
     "sum of kernel values behind a prediction", false},
    {LayerId::kSd, "sd", true, Raster::kPerTriangle, Element::kU16, 0.001, "m", "standard deviation of the height",
     false},
    {LayerId::kTerrain, "terrain", true, Raster::kPerTriangle, Element::kU16, 0.001, "m",
     "points up to this far above the surface are terrain", false},
    {LayerId::kRoughness, "roughness", true, Raster::kPerTriangle, Element::kU16, 0.001, "m",
     "rms distance of terrain points from the surface", false},
    {LayerId::kStep, "step", true, Raster::kPerTriangle, Element::kU16, 0.001, "m", "jump in height of the ground",
     false},
    {LayerId::kClearance, "clearance", true, Raster::kPerTriangle, Element::kU16, 0.001, "m",
     "from the surface up to the lowest thing above it", true},
    {LayerId::kCost, "cost", true, Raster::kPerTriangle, Element::kU8, 1.0 / 254, "1",
     "cost of crossing, missing where not traversable", true},
    {LayerId::kSourceLevel, "source_level", true, Raster::kPerTriangle, Element::kU8, 0, "1",
     "levels coarser than the finest that the height comes from", false},
    {LayerId::kUpper, "upper", true, Raster::kPerUpper, Element::kI32, 0, nullptr,
     "index of the triangle below a further surface, in (tri, y, x)", false},
    {LayerId::kUpperHeight, "upper_height", true, Raster::kPerUpper, Element::kI32, 0.001, "m",
     "height of the further surface at the square's centre", false},
    {LayerId::kUpperSlopeX, "upper_slope_x", true, Raster::kPerUpper, Element::kI16, 1.0 / 8192, "1",
     "rise of the further surface to the east", false},
    {LayerId::kUpperSlopeY, "upper_slope_y", true, Raster::kPerUpper, Element::kI16, 1.0 / 8192, "1",
     "rise of the further surface to the north", false},
    {LayerId::kUpperSd, "upper_sd", true, Raster::kPerUpper, Element::kU16, 0.001, "m",
     "spread of the points of the further surface about it", false},
    {LayerId::kUpperCount, "upper_count", true, Raster::kPerUpper, Element::kU16, 0, "1",
     "points of the further surface, 65535 is that many or more", false},
    {LayerId::kUpperKind, "upper_kind", true, Raster::kPerUpper, Element::kU8, 0, nullptr, "kind of further surface",
     false},
};

// fn(plane, file row, col) -> value, in the order of the file.
template <class T, class Fn>
std::vector<std::uint8_t> fill_raster(const LayerShape& s, Fn&& fn) {
  std::vector<std::uint8_t> out(s.elements() * sizeof(T));
  std::uint8_t* p = out.data();
  for (std::size_t plane = 0; plane < s.planes; ++plane)
    for (std::size_t row = 0; row < s.rows; ++row)
      for (std::size_t col = 0; col < s.cols; ++col, p += sizeof(T)) {
        const T value = fn(plane, row, col);
        std::memcpy(p, &value, sizeof value);
      }
  return out;
}

template <class T, class Fn>
void each_value(const LayerShape& s, std::span<const std::uint8_t> values, Fn&& fn) {
  const std::uint8_t* p = values.data();
  for (std::size_t plane = 0; plane < s.planes; ++plane)
    for (std::size_t row = 0; row < s.rows; ++row)
      for (std::size_t col = 0; col < s.cols; ++col, p += sizeof(T)) {
        T value;
        std::memcpy(&value, p, sizeof value);
        fn(plane, row, col, value);
      }
}

// Index of a raster element in the tile's own, south-first order.
std::size_t flipped(const LayerShape& s, std::size_t row, std::size_t col) { return (s.rows - 1 - row) * s.cols + col; }

template <class T, class Get>
std::vector<std::uint8_t> gather_nodes(const LayerShape& s, const TerrainTile& tile, Get&& get) {
  return fill_raster<T>(s, [&](std::size_t t, std::size_t row, std::size_t col) {
    return static_cast<T>(get(tile.nodes[flipped(s, row, col) * kTriangles + t]));
  });
}

}  // namespace

std::span<const LayerInfo> layer_table() { return kLayers; }

std::vector<std::uint8_t> fill_value(const LayerInfo& layer) {
  std::vector<std::uint8_t> bytes(element_bytes(layer.element), 0);
  if (!layer.marks_missing) return bytes;
  switch (layer.element) {
    case Element::kF32: {
      constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
      std::memcpy(bytes.data(), &kNan, sizeof kNan);
      break;
    }
    case Element::kI32:
      std::memcpy(bytes.data(), &kUnknownHeight_mm, sizeof kUnknownHeight_mm);
      break;
    default:
      std::fill(bytes.begin(), bytes.end(), std::uint8_t{255});
  }
  return bytes;
}

LayerShape layer_shape(const LayerInfo& layer, const CellBox& box, std::size_t upper) {
  if (layer.raster == Raster::kPerUpper) return {1, 1, upper};
  const std::size_t extra = layer.raster == Raster::kPerCorner ? 1 : 0;
  return {layer.raster == Raster::kPerTriangle ? std::size_t{kTriangles} : 1,
          static_cast<std::size_t>(box.rows()) + extra, static_cast<std::size_t>(box.cols()) + extra};
}

LayerShape chunk_shape(const LayerInfo& layer, const CellBox& box, std::size_t upper) {
  if (layer.raster == Raster::kPerUpper) return {1, 1, std::min(upper, kChunkUpper)};
  const std::size_t limit = kChunkCells + (layer.raster == Raster::kPerCorner ? 1 : 0);
  LayerShape s = layer_shape(layer, box, upper);
  s.rows = std::min(s.rows, limit);
  s.cols = std::min(s.cols, limit);
  return s;
}

std::vector<std::uint8_t> gather(const LayerInfo& layer, const TerrainTile& tile) {
  const LayerShape s = layer_shape(layer, tile.box, 0);
  const auto squares = [&](auto value_of) {
    return
        [&, value_of](std::size_t, std::size_t row, std::size_t col) { return value_of(tile, flipped(s, row, col)); };
  };
  switch (layer.id) {
    case LayerId::kElevation:
      return fill_raster<float>(s, squares(square_elevation_m));
    case LayerId::kElevationSd:
      return fill_raster<float>(s, squares(square_sd_m));
    case LayerId::kSlope:
      return fill_raster<float>(s, squares(square_slope_deg));
    case LayerId::kClass:
      return fill_raster<std::uint8_t>(s, squares(square_class));
    case LayerId::kGisRoughness:
      return fill_raster<float>(s, squares(square_roughness_m));
    case LayerId::kGisStep:
      return fill_raster<float>(s, squares(square_step_m));
    case LayerId::kGisClearance:
      return fill_raster<float>(s, squares(square_clearance_m));
    case LayerId::kGisCost:
      return fill_raster<float>(s, squares(square_cost));
    case LayerId::kUpperElevation:
      return fill_raster<float>(s,
                                [&, upper = upper_elevations_m(tile)](std::size_t, std::size_t row, std::size_t col) {
                                  return upper[flipped(s, row, col)];
                                });
    case LayerId::kCornerHeight:
      return fill_raster<std::int32_t>(
          s, [&](std::size_t, std::size_t row, std::size_t col) { return tile.corner_mm[flipped(s, row, col)]; });
    case LayerId::kCentreHeight:
      return fill_raster<std::int32_t>(
          s, [&](std::size_t, std::size_t row, std::size_t col) { return tile.centre_mm[flipped(s, row, col)]; });
    case LayerId::kState:
      return gather_nodes<std::uint8_t>(s, tile, [](const NodeSurface& n) { return n.state; });
    case LayerId::kWeight:
      return gather_nodes<std::uint8_t>(s, tile, [](const NodeSurface& n) { return n.weight; });
    case LayerId::kCount:
      return gather_nodes<std::uint16_t>(s, tile, [](const NodeSurface& n) { return n.count; });
    case LayerId::kSupport:
      return gather_nodes<std::uint16_t>(s, tile, [](const NodeSurface& n) { return n.support; });
    case LayerId::kSd:
      return gather_nodes<std::uint16_t>(s, tile, [](const NodeSurface& n) { return n.sd_mm; });
    case LayerId::kTerrain:
      return gather_nodes<std::uint16_t>(s, tile, [](const NodeSurface& n) { return n.terrain_mm; });
    case LayerId::kRoughness:
      return gather_nodes<std::uint16_t>(s, tile, [](const NodeSurface& n) { return n.roughness_mm; });
    case LayerId::kStep:
      return gather_nodes<std::uint16_t>(s, tile, [](const NodeSurface& n) { return n.step_mm; });
    case LayerId::kClearance:
      return gather_nodes<std::uint16_t>(s, tile, [](const NodeSurface& n) { return n.clearance_mm; });
    case LayerId::kCost:
      return gather_nodes<std::uint8_t>(s, tile, [](const NodeSurface& n) { return n.cost; });
    case LayerId::kSourceLevel:
      return gather_nodes<std::uint8_t>(s, tile, [](const NodeSurface& n) { return n.source_level; });
    default:
      return {};  // lists
  }
}

void scatter(const LayerInfo& layer, std::span<const std::uint8_t> values, TerrainTile& tile) {
  const LayerShape s = layer_shape(layer, tile.box, 0);
  const auto nodes = [&](auto set) {
    return [&, set](std::size_t t, std::size_t row, std::size_t col, auto value) {
      set(tile.nodes[flipped(s, row, col) * kTriangles + t], value);
    };
  };
  switch (layer.id) {
    case LayerId::kCornerHeight:
      return each_value<std::int32_t>(s, values, [&](std::size_t, std::size_t row, std::size_t col, std::int32_t v) {
        tile.corner_mm[flipped(s, row, col)] = v;
      });
    case LayerId::kCentreHeight:
      return each_value<std::int32_t>(s, values, [&](std::size_t, std::size_t row, std::size_t col, std::int32_t v) {
        tile.centre_mm[flipped(s, row, col)] = v;
      });
    case LayerId::kState:
      if (std::any_of(values.begin(), values.end(),
                      [](std::uint8_t v) { return v > static_cast<std::uint8_t>(NodeState::kFilled); }))
        throw Error(ErrorCode::kVerification, "layer tgf/state holds a value that is no state");
      return each_value<std::uint8_t>(s, values, nodes([](NodeSurface& n, std::uint8_t v) { n.state = NodeState{v}; }));
    case LayerId::kWeight:
      return each_value<std::uint8_t>(s, values, nodes([](NodeSurface& n, std::uint8_t v) { n.weight = v; }));
    case LayerId::kCount:
      return each_value<std::uint16_t>(s, values, nodes([](NodeSurface& n, std::uint16_t v) { n.count = v; }));
    case LayerId::kSupport:
      return each_value<std::uint16_t>(s, values, nodes([](NodeSurface& n, std::uint16_t v) { n.support = v; }));
    case LayerId::kSd:
      return each_value<std::uint16_t>(s, values, nodes([](NodeSurface& n, std::uint16_t v) { n.sd_mm = v; }));
    case LayerId::kTerrain:
      return each_value<std::uint16_t>(s, values, nodes([](NodeSurface& n, std::uint16_t v) { n.terrain_mm = v; }));
    case LayerId::kRoughness:
      return each_value<std::uint16_t>(s, values, nodes([](NodeSurface& n, std::uint16_t v) { n.roughness_mm = v; }));
    case LayerId::kStep:
      return each_value<std::uint16_t>(s, values, nodes([](NodeSurface& n, std::uint16_t v) { n.step_mm = v; }));
    case LayerId::kClearance:
      return each_value<std::uint16_t>(s, values, nodes([](NodeSurface& n, std::uint16_t v) { n.clearance_mm = v; }));
    case LayerId::kCost:
      return each_value<std::uint8_t>(s, values, nodes([](NodeSurface& n, std::uint8_t v) { n.cost = v; }));
    case LayerId::kSourceLevel:
      if (std::any_of(values.begin(), values.end(), [](std::uint8_t v) { return v > kCoarsestSource; }))
        throw Error(ErrorCode::kVerification, "layer tgf/source_level holds a level no map has");
      return each_value<std::uint8_t>(s, values, nodes([](NodeSurface& n, std::uint8_t v) { n.source_level = v; }));
    default:
      return;  // GIS layers follow from these; lists
  }
}

}  // namespace btms
