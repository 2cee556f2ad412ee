#include "io/export/pcd_tiles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/error.h"
#include "io/export/local_origin.h"
#include "io/files/atomic_file.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMgrsSquare_mm = 100'000'000;

struct Points {
  std::uint64_t count = 0;
  std::string bytes;
};

// Of the squares [row0, row1) x [col0, col1) of the frame's lattice.
Points points_of(const Window& window, const LocalOrigin& origin) {
  Points points;
  const std::vector<float>& heights = window.values[0];
  for (std::size_t row = 0; row < window.rows; ++row)
    for (std::size_t col = 0; col < window.cols; ++col) {
      const float z = heights[row * window.cols + col];
      if (std::isnan(z)) continue;
      const float xyz[] = {
          static_cast<float>(window.min_x_m + (static_cast<double>(col) + 0.5) * window.cell_m - origin.x_m()),
          static_cast<float>(window.max_y_m() - (static_cast<double>(row) + 0.5) * window.cell_m - origin.y_m()), z};
      points.bytes.append(reinterpret_cast<const char*>(xyz), sizeof xyz);
      ++points.count;
    }
  return points;
}

std::string header_of(std::uint64_t points, const MapInfo& info, const LocalOrigin& origin) {
  return fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\n"
      "# ground of a B-TMS map; origin_m {} {} 0 (add it to x, y, z); crs {}\n"
      "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
      "WIDTH {}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA binary\n",
      origin.x_m(), origin.y_m(), one_line(info.crs_wkt), points, points);
}

LocalOrigin origin_of(const RasterFrame& frame) {
  const auto mm = [&](std::int32_t square) { return std::llround(square * frame.cell_m * 1000); };
  const auto& b = frame.box;
  const bool near = std::max({std::abs(mm(b.col0)), std::abs(mm(b.col1)), std::abs(mm(b.row0)),
                              std::abs(mm(b.row1))}) <= kMgrsSquare_mm;
  return near ? LocalOrigin{} : LocalOrigin::below(mm(b.col0), mm(b.row0), kMgrsSquare_mm);
}

// Squares of the frame along the edge of a tile.
std::int32_t squares_of(double tile_m, double cell_m) {
  const double squares = tile_m / cell_m;
  if (!(squares >= 1 - 1e-9 && squares <= 4096) || std::abs(squares - std::round(squares)) > 1e-9 * squares)
    throw Error(ErrorCode::kUsage,
                fmt::format("tiles of {} m are not 1 to 4096 whole squares of {} m wide", tile_m, cell_m));
  return static_cast<std::int32_t>(std::lround(squares));
}

// A folder that is removed with what is in it unless it got its name.
struct Unfinished {
  fs::path path;
  ~Unfinished() {
    std::error_code ignored;
    if (!path.empty()) fs::remove_all(path, ignored);
  }
};

}  // namespace

fs::path pcd_metadata_of(const fs::path& folder) { return folder.parent_path() / "pointcloud_map_metadata.yaml"; }

PcdTilesSize write_pcd_tiles(const MapReader& map, const TileSource& tiles, const RasterFrame& frame, double tile_m,
                             const fs::path& folder) {
  const std::int32_t edge = squares_of(tile_m, frame.cell_m);
  const LocalOrigin origin = origin_of(frame);
  const RasterLayer* const layers[] = {find_raster_layer("elevation")};
  PcdTilesSize size;
  size.origin_x_m = origin.x_m();
  size.origin_y_m = origin.y_m();
  Unfinished unfinished{folder.string() + ".part"};
  if (fs::exists(unfinished.path))
    throw Error(ErrorCode::kUsage, "is left of an export that was interrupted; remove it", unfinished.path.string());
  make_folders(unfinished.path);
  std::string metadata = fmt::format("x_resolution: {}\ny_resolution: {}\n", tile_m, tile_m);
  const CellBox& all = frame.box;
  for (std::int64_t row = floor_div(all.row0, edge) * edge; row < all.row1; row += edge)
    for (std::int64_t col = floor_div(all.col0, edge) * edge; col < all.col1; col += edge) {
      const CellBox part = CellBox{static_cast<std::int32_t>(col), static_cast<std::int32_t>(row),
                                   static_cast<std::int32_t>(col + edge), static_cast<std::int32_t>(row + edge)}
                               .intersect(all);
      const Points points =
          points_of(read_part(map, tiles, frame, static_cast<std::size_t>(all.row1 - part.row1),
                              static_cast<std::size_t>(part.col0 - all.col0), static_cast<std::size_t>(part.rows()),
                              static_cast<std::size_t>(part.cols()), layers),
                    origin);
      if (points.count == 0) continue;
      const double x_m = static_cast<double>(col) * frame.cell_m - origin.x_m(),
                   y_m = static_cast<double>(row) * frame.cell_m - origin.y_m();
      const std::string name = fmt::format("{}_{}.pcd", x_m, y_m), file = header_of(points.count, map.info(), origin);
      write_file(unfinished.path / name, std::string_view(file + points.bytes));
      metadata += fmt::format("{}: [{}, {}]\n", name, x_m, y_m);
      ++size.files;
      size.points += points.count;
      size.bytes += file.size() + points.bytes.size();
    }
  if (size.files == 0) throw Error(ErrorCode::kUsage, "there is no surface in the box");
  std::error_code error;
  fs::rename(unfinished.path, folder, error);
  if (error) throw Error(ErrorCode::kFailed, "cannot be named: " + error.message(), folder.string());
  unfinished.path.clear();
  write_file(pcd_metadata_of(folder), std::string_view(metadata));
  size.bytes += metadata.size();
  return size;
}

}  // namespace btms
