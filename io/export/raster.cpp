#include "io/export/raster.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"
#include "engine/model/square_layers.h"
#include "engine/model/surface.h"

namespace btms {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

float class_of(const TerrainTile& tile, std::size_t cell) { return square_class(tile, cell); }

constexpr std::array kLayers = {
    RasterLayer{"elevation", "m", square_elevation_m}, RasterLayer{"elevation_sd", "m", square_sd_m},
    RasterLayer{"slope", "degree", square_slope_deg},  RasterLayer{"class", nullptr, class_of},
    RasterLayer{"roughness", "m", square_roughness_m}, RasterLayer{"step", "m", square_step_m},
    RasterLayer{"clearance", "m", square_clearance_m}, RasterLayer{"cost", "1", square_cost},
    RasterLayer{"upper_elevation", "m", nullptr},
};

// The finest square whose values a square of the level has.
Cell sampled(Cell square, int level) {
  const auto at = [level](std::int32_t n) {
    return static_cast<std::int32_t>((std::int64_t{n} << level) + (level > 0 ? std::int64_t{1} << (level - 1) : 0));
  };
  return {at(square.col), at(square.row)};
}

// The squares of the level whose samples lie in a box of the finest.
CellBox squares_sampled_in(const CellBox& fine, int level) {
  const std::int64_t edge = std::int64_t{1} << level, half = edge / 2;
  const auto at = [&](std::int32_t n) { return static_cast<std::int32_t>(ceil_div(n - half, edge)); };
  return {at(fine.col0), at(fine.row0), at(fine.col1), at(fine.row1)};
}

float corner_elevation_m(const TerrainTile& tile, Cell cell) {
  const std::int64_t r = tile.resolution_mm;
  const SurfacePoint p = surface_in(tile, cell.col * r, cell.row * r);
  return p.state == NodeState::kUnknown ? kNothing : static_cast<float>(p.z_m);
}

void fill(Window& window, const TerrainTile& tile, const CellBox& part) {
  for (std::size_t l = 0; l < window.layers.size(); ++l) {
    const RasterLayer& layer = *window.layers[l];
    const std::vector<float> upper = layer.square ? std::vector<float>{} : upper_elevations_m(tile);
    const bool at_corner = window.level > 0 && layer.square == square_elevation_m;
    for (std::int32_t row = part.row0; row < part.row1; ++row)
      for (std::int32_t col = part.col0; col < part.col1; ++col) {
        const Cell from = sampled({col, row}, window.level);
        const std::size_t cell = tile.cell_index(from);
        float& to = window.values[l][static_cast<std::size_t>(window.box.row1 - 1 - row) * window.cols() +
                                     static_cast<std::size_t>(col - window.box.col0)];
        to = at_corner ? corner_elevation_m(tile, from) : layer.square ? layer.square(tile, cell) : upper[cell];
      }
  }
}

void check(const CellBox& box, int level, std::size_t layers) {
  if (level < 0 || level > kMaxLevel)
    throw Error(ErrorCode::kUsage, "levels go from 0 to " + std::to_string(kMaxLevel));
  if (box.empty()) throw Error(ErrorCode::kUsage, "the window is empty");
  const std::int64_t most = kCellBias >> level;
  if (box.col0 < -most || box.row0 < -most || box.col1 > most || box.row1 > most)
    throw Error(ErrorCode::kUsage, "the window lies beyond the coordinates of maps");
  if (box.cols() > kMaxWindowSquares || box.rows() > kMaxWindowSquares ||
      box.cells() > kMaxWindowSquares / static_cast<std::int64_t>(std::max<std::size_t>(layers, 1)))
    throw Error(ErrorCode::kUsage,
                "the window has more than " + std::to_string(kMaxWindowSquares) + " values: ask for a coarser level");
}

}  // namespace

std::span<const RasterLayer> raster_layers() { return kLayers; }

const RasterLayer* find_raster_layer(std::string_view name) {
  const auto it = std::find_if(kLayers.begin(), kLayers.end(), [&](const RasterLayer& l) { return l.name == name; });
  return it == kLayers.end() ? nullptr : &*it;
}

bool Window::empty() const {
  return std::all_of(values.begin(), values.end(), [](const std::vector<float>& layer) {
    return std::all_of(layer.begin(), layer.end(), [](float v) { return std::isnan(v); });
  });
}

Window cut_window(const TileSource& map, int level, const CellBox& box, std::span<const RasterLayer* const> layers) {
  check(box, level, layers.size());
  Window window;
  window.level = level;
  window.box = box;
  window.cell_m = std::ldexp(map.layout().lattice.resolution_m(), level);
  window.layers.assign(layers.begin(), layers.end());
  window.values.assign(layers.size(), std::vector<float>(static_cast<std::size_t>(box.cells()), kNothing));
  const TileGrid& grid = map.layout().grid;
  const Cell first = sampled({box.col0, box.row0}, level), last = sampled({box.col1 - 1, box.row1 - 1}, level);
  grid.for_each_tile({first.col, first.row, last.col + 1, last.row + 1}, [&](TileId id) {
    if (squares_sampled_in(grid.box_of(id), level).intersect(box).empty()) return;
    const auto tile = map.load(id);
    if (!tile) return;
    fill(window, *tile, squares_sampled_in(tile->box, level).intersect(box));
  });
  return window;
}

}  // namespace btms
