#include "engine/model/tile_samples.h"

#include <algorithm>
#include <array>
#include <limits>

#include "engine/model/square_layers.h"
#include "engine/model/surface.h"

namespace btms {
namespace {

float class_of(const TerrainTile& tile, std::size_t cell) { return square_class(tile, cell); }

constexpr std::array kLayers = {
    RasterLayer{"elevation", "m", square_elevation_m}, RasterLayer{"elevation_sd", "m", square_sd_m},
    RasterLayer{"slope", "degree", square_slope_deg},  RasterLayer{"class", nullptr, class_of},
    RasterLayer{"roughness", "m", square_roughness_m}, RasterLayer{"step", "m", square_step_m},
    RasterLayer{"clearance", "m", square_clearance_m}, RasterLayer{"cost", "1", square_cost},
    RasterLayer{"upper_elevation", "m", nullptr},
};

}  // namespace

std::span<const RasterLayer> raster_layers() { return kLayers; }

const RasterLayer* find_raster_layer(std::string_view name) {
  const auto it = std::find_if(kLayers.begin(), kLayers.end(), [&](const RasterLayer& l) { return l.name == name; });
  return it == kLayers.end() ? nullptr : &*it;
}

Cell sampled(Cell square, int level) {
  const auto at = [level](std::int32_t n) {
    return static_cast<std::int32_t>((std::int64_t{n} << level) + (level > 0 ? std::int64_t{1} << (level - 1) : 0));
  };
  return {at(square.col), at(square.row)};
}

CellBox squares_sampled_in(const CellBox& fine, int level) {
  const std::int64_t edge = std::int64_t{1} << level, half = edge / 2;
  const auto at = [&](std::int32_t n) { return static_cast<std::int32_t>(ceil_div(n - half, edge)); };
  return {at(fine.col0), at(fine.row0), at(fine.col1), at(fine.row1)};
}

float elevation_at_m(const TerrainTile& tile, std::int64_t x_mm, std::int64_t y_mm) {
  const SurfacePoint p = surface_in(tile, x_mm, y_mm);
  return p.state == NodeState::kUnknown ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(p.z_m);
}

TileSamples::TileSamples(const TerrainTile& tile, std::span<const RasterLayer* const> layers) : tile_(tile) {
  for (const RasterLayer* layer : layers)
    if (!layer->square && upper_.empty()) upper_ = upper_elevations_m(tile);
}

float TileSamples::of(const RasterLayer& layer, Cell square, int level) const {
  const Cell from = sampled(square, level);
  if (level == 0 || layer.square != square_elevation_m) return of(layer, tile_.cell_index(from));
  const std::int64_t r = tile_.resolution_mm;
  return elevation_at_m(tile_, from.col * r, from.row * r);
}

}  // namespace btms
