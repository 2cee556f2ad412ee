#include "io/export/raster.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"
#include "engine/model/square_layers.h"
#include "io/store/manifest.h"
#include "io/store/shard_overview.h"

namespace btms {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

// value(layer, square) for the part of the window that has its values from there.
template <class Value>
void fill(Window& window, const CellBox& box, const CellBox& part, const Value& value) {
  for (std::size_t l = 0; l < window.layers.size(); ++l)
    for (std::int32_t row = part.row0; row < part.row1; ++row)
      for (std::int32_t col = part.col0; col < part.col1; ++col)
        window.values[l][static_cast<std::size_t>(box.row1 - 1 - row) * window.cols +
                         static_cast<std::size_t>(col - box.col0)] = value(*window.layers[l], Cell{col, row});
}

void fill_from_tile(Window& window, const CellBox& box, const TerrainTile& tile) {
  const TileSamples samples(tile, window.layers);
  fill(window, box, squares_sampled_in(tile.box, window.level).intersect(box),
       [&](const RasterLayer& layer, Cell square) { return samples.of(layer, square, window.level); });
}

Window window_of(std::size_t rows, std::size_t cols, std::span<const RasterLayer* const> layers) {
  Window window;
  window.rows = rows;
  window.cols = cols;
  window.layers.assign(layers.begin(), layers.end());
  window.values.assign(layers.size(), std::vector<float>(rows * cols, kNothing));
  return window;
}

void check_size(std::uint64_t rows, std::uint64_t cols, std::size_t layers) {
  constexpr auto kMost = static_cast<std::uint64_t>(kMaxWindowSquares);
  if (rows == 0 || cols == 0) throw Error(ErrorCode::kUsage, "the window is empty");
  if (rows > kMost || cols > kMost || rows * cols > kMost / std::max<std::size_t>(layers, 1))
    throw Error(ErrorCode::kUsage,
                "the window has more than " + std::to_string(kMost) + " values: ask for larger squares");
}

void check(const CellBox& box, int level, std::size_t layers) {
  if (level < 0 || level > kMaxLevel)
    throw Error(ErrorCode::kUsage, "levels go from 0 to " + std::to_string(kMaxLevel));
  if (box.empty()) throw Error(ErrorCode::kUsage, "the window is empty");
  const std::int64_t most = kCellBias >> level;
  if (box.col0 < -most || box.row0 < -most || box.col1 > most || box.row1 > most)
    throw Error(ErrorCode::kUsage, "the window lies beyond the coordinates of maps");
  check_size(static_cast<std::uint64_t>(box.rows()), static_cast<std::uint64_t>(box.cols()), layers);
}

// Layers of level 0 as they are stored; false where they are not.
bool fill_from_layers(Window& window, const CellBox& box, const MapReader& map, TileId id) {
  for (std::size_t l = 0; l < window.layers.size(); ++l) {
    const std::optional<LayerValues> stored = map.layer_values(id, window.layers[l]->name);
    if (!stored) return false;
    const CellBox part = stored->box.intersect(box);
    const auto from_cols = static_cast<std::size_t>(stored->box.cols()), n = static_cast<std::size_t>(part.cols());
    for (std::int32_t row = part.row0; row < part.row1; ++row)
      std::copy_n(stored->values.begin() +
                      static_cast<std::ptrdiff_t>(static_cast<std::size_t>(stored->box.row1 - 1 - row) * from_cols +
                                                  static_cast<std::size_t>(part.col0 - stored->box.col0)),
                  n,
                  window.values[l].begin() +
                      static_cast<std::ptrdiff_t>(static_cast<std::size_t>(box.row1 - 1 - row) * window.cols +
                                                  static_cast<std::size_t>(part.col0 - box.col0)));
  }
  return true;
}

Window level_window(const MapLayout& layout, int level, const CellBox& box,
                    std::span<const RasterLayer* const> layers) {
  check(box, level, layers.size());
  Window window = window_of(static_cast<std::size_t>(box.rows()), static_cast<std::size_t>(box.cols()), layers);
  window.level = level;
  window.cell_m = std::ldexp(layout.lattice.resolution_m(), level);
  window.min_x_m = box.col0 * window.cell_m;
  window.min_y_m = box.row0 * window.cell_m;
  return window;
}

}  // namespace

bool Window::empty() const {
  return std::all_of(values.begin(), values.end(), [](const std::vector<float>& layer) {
    return std::all_of(layer.begin(), layer.end(), [](float v) { return std::isnan(v); });
  });
}

Window cut_window(const TileSource& map, int level, const CellBox& box, std::span<const RasterLayer* const> layers) {
  Window window = level_window(map.layout(), level, box, layers);
  const TileGrid& grid = map.layout().grid;
  const Cell first = sampled({box.col0, box.row0}, level), last = sampled({box.col1 - 1, box.row1 - 1}, level);
  grid.for_each_tile({first.col, first.row, last.col + 1, last.row + 1}, [&](TileId id) {
    if (squares_sampled_in(grid.box_of(id), level).intersect(box).empty()) return;
    if (const auto tile = map.load(id)) fill_from_tile(window, box, *tile);
  });
  return window;
}

Window cut_window(const MapReader& map, const TileSource& tiles, int level, const CellBox& box,
                  std::span<const RasterLayer* const> layers) {
  if (level > 0 && level < kFirstOverview) return cut_window(tiles, level, box, layers);
  Window window = level_window(map.layout(), level, box, layers);
  if (level == 0) {
    map.layout().grid.for_each_tile(box, [&](TileId id) {
      if (fill_from_layers(window, box, map, id)) return;
      if (const auto tile = tiles.load(id)) fill_from_tile(window, box, *tile);
    });
    return window;
  }
  for (const ShardEntry& shard : map.shards()) {
    if (squares_sampled_in(shard.bounds(), level).intersect(box).empty()) continue;
    const std::optional<ShardOverview> overview = map.overview(shard);
    // Between its tiles a shard has nothing.
    for (const TileEntry& tile : shard.tiles) {
      const CellBox part = squares_sampled_in(tile.box, level).intersect(box);
      if (part.empty()) continue;
      if (overview)
        fill(window, box, part, [&](const RasterLayer& layer, Cell square) {
          return overview->at(static_cast<std::size_t>(&layer - raster_layers().data()), square, level);
        });
      else
        fill_from_tile(window, box, *tiles.load(tile.id));
    }
  }
  return window;
}

Window sample_window(const TileSource& map, double min_x_m, double min_y_m, double cell_m, std::size_t rows,
                     std::size_t cols, std::span<const RasterLayer* const> layers) {
  check_size(rows, cols, layers.size());
  constexpr double kLimit_m = static_cast<double>(kMaxHorizontal_mm) / 1000;
  const auto beyond = [](double low, double extent) { return !(std::abs(low) + extent <= kLimit_m); };
  if (!(cell_m > 0) || beyond(min_x_m, static_cast<double>(cols) * cell_m) ||
      beyond(min_y_m, static_cast<double>(rows) * cell_m))
    throw Error(ErrorCode::kUsage, "the window lies beyond the coordinates of maps");
  Window window = window_of(rows, cols, layers);
  window.min_x_m = min_x_m;
  window.min_y_m = min_y_m;
  window.cell_m = cell_m;
  const Lattice lattice = map.layout().lattice;
  const TileGrid& grid = map.layout().grid;
  const auto mm = [&](double low, std::size_t n) {
    return static_cast<std::int64_t>(std::floor((low + (static_cast<double>(n) + 0.5) * cell_m) * 1000 + 0.5));
  };
  std::vector<std::int64_t> x_mm(cols), y_mm(rows);
  for (std::size_t c = 0; c < cols; ++c) x_mm[c] = mm(min_x_m, c);
  for (std::size_t row = 0; row < rows; ++row) y_mm[row] = mm(min_y_m, rows - 1 - row);
  // Tile by tile, so that each is loaded once: runs of rows and columns that lie in one.
  const auto tile_of = [&](std::int64_t x, std::int64_t y) { return grid.tile_of(lattice.cell_at(x, y)); };
  for (std::size_t row0 = 0, row1; row0 < rows; row0 = row1) {
    for (row1 = row0 + 1; row1 < rows && tile_of(x_mm[0], y_mm[row1]).ty == tile_of(x_mm[0], y_mm[row0]).ty;) ++row1;
    for (std::size_t col0 = 0, col1; col0 < cols; col0 = col1) {
      const TileId id = tile_of(x_mm[col0], y_mm[row0]);
      for (col1 = col0 + 1; col1 < cols && tile_of(x_mm[col1], y_mm[row0]) == id;) ++col1;
      const auto tile = map.load(id);
      if (!tile) continue;
      const TileSamples values(*tile, layers);
      for (std::size_t row = row0; row < row1; ++row)
        for (std::size_t col = col0; col < col1; ++col) {
          const Cell cell = lattice.cell_at(x_mm[col], y_mm[row]);
          if (!tile->box.contains(cell)) continue;
          for (std::size_t l = 0; l < layers.size(); ++l)
            window.values[l][row * cols + col] = layers[l]->square == square_elevation_m
                                                     ? elevation_at_m(*tile, x_mm[col], y_mm[row])
                                                     : values.of(*layers[l], tile->cell_index(cell));
        }
    }
  }
  return window;
}

}  // namespace btms
