// The surface of one level over a tile, and the priors it gives.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/lattice/plane.h"
#include "engine/lattice/tiles.h"
#include "engine/terrain/level_corners.h"
#include "engine/terrain/level_fit.h"

namespace btms {

// Heights and uncertainties at the corners of a box of cells; integers, like everything that is handed on.
struct LevelSurface {
  using Corner = LevelCorner;
  static constexpr std::uint8_t kOutside = 255;
  std::int32_t r_mm = 0;
  CellBox box;
  std::vector<Corner> corners;       // (rows + 1) x (cols + 1)
  std::vector<Corner> centres;       // rows x cols
  std::vector<std::uint8_t> source;  // per node: levels coarser than this that its height comes from, or kOutside

  LevelSurface() = default;
  LevelSurface(std::int32_t r, const CellBox& b)
      : r_mm(r),
        box(b),
        corners(static_cast<std::size_t>((b.rows() + 1) * (b.cols() + 1))),
        centres(static_cast<std::size_t>(b.cells())),
        source(static_cast<std::size_t>(b.cells()) * kTriangles, kOutside) {}

  std::size_t corner_index(Cell c) const {
    return static_cast<std::size_t>((std::int64_t{c.row} - box.row0) * (box.cols() + 1) + (c.col - box.col0));
  }
  std::size_t cell_index(Cell c) const {
    return static_cast<std::size_t>((std::int64_t{c.row} - box.row0) * box.cols() + (c.col - box.col0));
  }
  std::uint8_t source_of(NodeId n) const { return source[cell_index(n.cell) * kTriangles + n.triangle]; }
  bool is_outside(NodeId n) const { return source_of(n) == kOutside; }

  std::array<Corner, 3> corners_of(NodeId n) const {
    const auto rel = triangle_corners(n.triangle);
    const auto at = [&](HalfCell h) { return corners[corner_index({n.cell.col + h.x / 2, n.cell.row + h.y / 2})]; };
    return {centres[cell_index(n.cell)], at(rel[1]), at(rel[2])};
  }

  // The plane of a node of this surface, in the frame of its square's centre. Precondition: not outside.
  PriorPlane plane_of(NodeId n) const {
    const auto c = corners_of(n);
    const FinalPlane f = FinalPlane::through(n.triangle, {c[0].z_mm, c[1].z_mm, c[2].z_mm});
    return {static_cast<double>(f.centre_mm), static_cast<double>(f.rise_x_mm) / r_mm,
            static_cast<double>(f.rise_y_mm) / r_mm, (static_cast<double>(c[0].sd_mm) + c[1].sd_mm + c[2].sd_mm) / 3,
            source_of(n)};
  }
  // The same plane in the frame of a square centre of the next finer lattice.
  PriorPlane plane_for_child(NodeId child) const {
    const NodeId p = parent(child);
    PriorPlane plane = plane_of(p);
    ++plane.source;
    const Lattice coarse(r_mm), fine(r_mm / 2);
    plane.z = plane.at(static_cast<double>(fine.centre_x_mm(child.cell) - coarse.centre_x_mm(p.cell)),
                       static_cast<double>(fine.centre_y_mm(child.cell) - coarse.centre_y_mm(p.cell)));
    return plane;
  }
};

}  // namespace btms
