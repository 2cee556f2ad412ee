// The surface of one level over a tile, and the priors it gives.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/lattice/plane.h"
#include "engine/lattice/tiles.h"
#include "engine/terrain/level_corners.h"
#include "engine/terrain/level_fit.h"
#include "engine/tiling/paged.h"

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

  template <class Fn>
  void for_each_buffer(const Fn& fn) {
    fn(corners), fn(centres), fn(source);
  }
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
    return plane_through(n.triangle, c[0], c[1], c[2], source_of(n));
  }
  // Those of a square; of nodes outside they mean nothing.
  SquarePriors planes_of(Cell c) const {
    const Corner *south = &corners[corner_index(c)], *north = south + box.cols() + 1, &m = centres[cell_index(c)];
    const std::uint8_t* from = &source[cell_index(c) * kTriangles];
    return {plane_through(kEast, m, south[1], north[1], from[kEast]),
            plane_through(kNorth, m, north[1], north[0], from[kNorth]),
            plane_through(kWest, m, north[0], south[0], from[kWest]),
            plane_through(kSouth, m, south[0], south[1], from[kSouth])};
  }
  // The same planes in the frame of a square centre of the next finer lattice, node by node of that square.
  SquarePriors planes_for_child(Cell child) const {
    const Cell square = parent({child, 0}).cell;
    const SquarePriors planes = planes_of(square);
    const Lattice coarse(r_mm), fine(r_mm / 2);
    const auto x = static_cast<double>(fine.centre_x_mm(child) - coarse.centre_x_mm(square));
    const auto y = static_cast<double>(fine.centre_y_mm(child) - coarse.centre_y_mm(square));
    SquarePriors out;
    for (std::uint8_t t = 0; t < kTriangles; ++t) {
      out[t] = planes[parent({child, t}).triangle];
      out[t].z = out[t].at(x, y);
      ++out[t].source;
    }
    return out;
  }

 private:
  PriorPlane plane_through(std::uint8_t triangle, const Corner& m, const Corner& p, const Corner& q,
                           std::uint8_t from) const {
    const FinalPlane f = FinalPlane::through(triangle, {m.z_mm, p.z_mm, q.z_mm});
    return {static_cast<double>(f.centre_mm), static_cast<double>(f.rise_x_mm) / r_mm,
            static_cast<double>(f.rise_y_mm) / r_mm, (static_cast<double>(m.sd_mm) + p.sd_mm + q.sd_mm) / 3, from};
  }
};

using Surfaces = Paged<LevelSurface>;  // one a tile of the table

}  // namespace btms
