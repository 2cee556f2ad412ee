#include "io/export/map_raster.h"

#include <cmath>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"
#include "io/store/manifest.h"

namespace btms {
namespace {

CellBox bounds_of(const MapReader& map) {
  CellBox bounds;
  for (const ShardEntry& shard : map.shards()) bounds = bounds.hull(shard.bounds());
  if (bounds.empty()) throw Error(ErrorCode::kUsage, "the map is empty");
  return bounds;
}

RasterFrame frame_of(const MapReader& map, double cell_m, const std::optional<std::array<double, 4>>& box_m) {
  constexpr double kBeside = 1e-6, kLimit_m = static_cast<double>(kMaxHorizontal_mm) / 1000;
  const CellBox bounds = bounds_of(map);
  const double r_m = map.layout().lattice.resolution_m();
  const std::array<double, 4> whole_m = {bounds.col0 * r_m, bounds.row0 * r_m, bounds.col1 * r_m, bounds.row1 * r_m};
  const std::array<double, 4>& b = box_m ? *box_m : whole_m;
  if (!(b[0] < b[2] && b[1] < b[3])) throw Error(ErrorCode::kUsage, "the box is empty");
  if (b[2] <= whole_m[0] || b[0] >= whole_m[2] || b[3] <= whole_m[1] || b[1] >= whole_m[3])
    throw Error(ErrorCode::kUsage, "the box lies where the map is not; `btms info` says where that is");
  for (const double edge : b)
    if (!(std::abs(edge) <= kLimit_m) || !(std::abs(edge / cell_m) <= static_cast<double>(kCellBias)))
      throw Error(ErrorCode::kUsage, "the box lies beyond the coordinates of maps");
  const auto low = [&](double v) { return static_cast<std::int32_t>(std::floor(v / cell_m + kBeside)); };
  const auto high = [&](double v) { return static_cast<std::int32_t>(std::ceil(v / cell_m - kBeside)); };
  return {-1, cell_m, {low(b[0]), low(b[1]), high(b[2]), high(b[3])}};
}

}  // namespace

Window RasterFrame::outline(std::span<const RasterLayer* const> layers) const {
  Window window;
  window.level = level;
  window.cell_m = cell_m;
  window.min_x_m = box.col0 * cell_m;
  window.min_y_m = box.row0 * cell_m;
  window.rows = rows();
  window.cols = cols();
  window.layers.assign(layers.begin(), layers.end());
  return window;
}

RasterFrame level_frame(const MapReader& map, int level, const std::optional<std::array<double, 4>>& box_m) {
  if (level < 0 || level > kMaxLevel)
    throw Error(ErrorCode::kUsage, "levels go from 0 to " + std::to_string(kMaxLevel));
  RasterFrame frame = frame_of(map, std::ldexp(map.layout().lattice.resolution_m(), level), box_m);
  frame.level = level;
  return frame;
}

RasterFrame square_frame(const MapReader& map, double cell_m, const std::optional<std::array<double, 4>>& box_m) {
  if (!(cell_m >= 1e-3)) throw Error(ErrorCode::kUsage, "squares have an edge of at least 0.001 m");
  return frame_of(map, cell_m, box_m);
}

Window read_part(const MapReader& map, const TileSource& tiles, const RasterFrame& frame, std::size_t row0,
                 std::size_t col0, std::size_t rows, std::size_t cols, std::span<const RasterLayer* const> layers) {
  const auto row1 = static_cast<std::int32_t>(frame.box.row1 - static_cast<std::int64_t>(row0));
  const auto first_col = static_cast<std::int32_t>(frame.box.col0 + static_cast<std::int64_t>(col0));
  const CellBox part{first_col, row1 - static_cast<std::int32_t>(rows), first_col + static_cast<std::int32_t>(cols),
                     row1};
  if (frame.level >= 0) return cut_window(map, tiles, frame.level, part, layers);
  return sample_window(tiles, part.col0 * frame.cell_m, part.row0 * frame.cell_m, frame.cell_m, rows, cols, layers);
}

}  // namespace btms
