#include "io/store/shard_assembly.h"

#include <algorithm>

#include "engine/error.h"

namespace btms {
namespace {

// Copies n values a row between two rasters, for the rows of `box` (and one more for corners).
template <class T>
void copy_rows(const std::vector<T>& from, std::size_t from_at, std::size_t from_stride, std::vector<T>& to,
               std::size_t to_at, std::size_t to_stride, std::size_t n, std::size_t rows) {
  for (std::size_t row = 0; row < rows; ++row)
    std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(from_at + row * from_stride), n,
                to.begin() + static_cast<std::ptrdiff_t>(to_at + row * to_stride));
}

// Copies the cells of `box`, which lies inside both.
void copy_cells(const TerrainTile& from, TerrainTile& to, const CellBox& box) {
  const auto cols = static_cast<std::size_t>(box.cols()), rows = static_cast<std::size_t>(box.rows());
  const auto from_cols = static_cast<std::size_t>(from.box.cols()), to_cols = static_cast<std::size_t>(to.box.cols());
  const Cell corner{box.col0, box.row0};
  copy_rows(from.centre_mm, from.cell_index(corner), from_cols, to.centre_mm, to.cell_index(corner), to_cols, cols,
            rows);
  copy_rows(from.nodes, from.cell_index(corner) * kTriangles, from_cols * kTriangles, to.nodes,
            to.cell_index(corner) * kTriangles, to_cols * kTriangles, cols * kTriangles, rows);
  copy_rows(from.corner_mm, from.corner_index(corner), from_cols + 1, to.corner_mm, to.corner_index(corner),
            to_cols + 1, cols + 1, rows + 1);
}

}  // namespace

TerrainTile assemble(std::vector<PlacedTile>&& tiles) {
  if (tiles.size() == 1) return std::move(tiles.front().second);
  CellBox hull;
  for (const PlacedTile& t : tiles) hull = hull.hull(t.second.box);
  TerrainTile whole(tiles.front().second.resolution_mm, hull);
  for (const PlacedTile& t : tiles) copy_cells(t.second, whole, t.second.box);
  // Cells belong to one tile each, corners to up to four: the last one written must be everyone's.
  for (const auto& [id, tile] : tiles)
    if (cut(whole, tile.box).corner_mm != tile.corner_mm)
      throw Error(ErrorCode::kFailed, "tile " + std::to_string(id.tx) + "," + std::to_string(id.ty) +
                                          " disagrees with a neighbour about the height of a shared corner");
  return whole;
}

TerrainTile cut(const TerrainTile& tile, const CellBox& box) {
  TerrainTile part(tile.resolution_mm, box);
  copy_cells(tile, part, box);
  return part;
}

}  // namespace btms
