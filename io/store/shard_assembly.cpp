#include "io/store/shard_assembly.h"

#include <algorithm>

#include "engine/error.h"

namespace btms {
namespace {

// Copies `rows` rows of n values between two rasters.
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
}

// Copies the lattice corners of the cells of `box`, which lies inside both.
void copy_corners(const TerrainTile& from, TerrainTile& to, const CellBox& box) {
  const Cell corner{box.col0, box.row0};
  copy_rows(from.corner_mm, from.corner_index(corner), static_cast<std::size_t>(from.box.cols()) + 1, to.corner_mm,
            to.corner_index(corner), static_cast<std::size_t>(to.box.cols()) + 1,
            static_cast<std::size_t>(box.cols()) + 1, static_cast<std::size_t>(box.rows()) + 1);
}

// Adds the further surfaces over `box`, which lies inside both; their order is left to the caller.
void copy_upper(const TerrainTile& from, TerrainTile& to, const CellBox& box) {
  for (UpperNode u : from.upper) {
    const std::uint32_t cell = u.node / kTriangles, cols = static_cast<std::uint32_t>(from.box.cols());
    const Cell c{from.box.col0 + static_cast<std::int32_t>(cell % cols),
                 from.box.row0 + static_cast<std::int32_t>(cell / cols)};
    if (!box.contains(c)) continue;
    u.node = static_cast<std::uint32_t>(to.cell_index(c)) * kTriangles + u.node % kTriangles;
    to.upper.push_back(u);
  }
}

// Cells belong to one tile each, corners to up to four. A tile leaves out the heights none of its own nodes needs, so
// whoever knows a height says it; two that know it must agree.
void join_corners(TileId id, const TerrainTile& from, TerrainTile& whole) {
  for (std::int32_t row = from.box.row0; row <= from.box.row1; ++row)
    for (std::int32_t col = from.box.col0; col <= from.box.col1; ++col) {
      const std::int32_t height = from.corner_mm[from.corner_index({col, row})];
      if (height == kUnknownHeight_mm) continue;
      std::int32_t& joined = whole.corner_mm[whole.corner_index({col, row})];
      if (joined != kUnknownHeight_mm && joined != height)
        throw Error(ErrorCode::kFailed, "tile " + std::to_string(id.tx) + "," + std::to_string(id.ty) +
                                            " disagrees with a neighbour about the height of a shared corner");
      joined = height;
    }
}

}  // namespace

TerrainTile assemble(std::vector<PlacedTile>&& tiles) {
  if (tiles.size() == 1) return std::move(tiles.front().second);
  CellBox hull;
  for (const PlacedTile& t : tiles) hull = hull.hull(t.second.box);
  TerrainTile whole(tiles.front().second.resolution_mm, hull);
  for (const auto& [id, tile] : tiles) {
    copy_cells(tile, whole, tile.box);
    copy_upper(tile, whole, tile.box);
    join_corners(id, tile, whole);
  }
  // Each tile's part ascends; nodes of one tile only meet those of others.
  std::stable_sort(whole.upper.begin(), whole.upper.end(),
                   [](const UpperNode& a, const UpperNode& b) { return a.node < b.node; });
  return whole;
}

TerrainTile cut(const TerrainTile& tile, const CellBox& box) {
  TerrainTile part(tile.resolution_mm, box);
  copy_cells(tile, part, box);
  copy_corners(tile, part, box);
  copy_upper(tile, part, box);
  return part;
}

}  // namespace btms
