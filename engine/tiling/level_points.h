// Walks over the points of a level, square by square.
#pragma once

#include <vector>

#include "engine/terrain/level_fit.h"
#include "engine/tiling/ordered_points.h"
#include "engine/tiling/passes.h"

namespace btms {

template <class Fn>
void for_each_cell(const CellBox& box, const Fn& fn) {
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for (std::int32_t col = box.col0; col < box.col1; ++col) fn(Cell{col, row});
}

template <class Fn>
void for_each_node(const CellBox& box, const Fn& fn) {
  for_each_cell(box, [&](Cell c) {
    for (std::uint8_t t = 0; t < kTriangles; ++t) fn(NodeId{c, t});
  });
}

// The cells of a bin on the lattice `depth` refinements below the coarsest.
inline CellBox cells_of(BinId bin, int depth) {
  return {bin.bx << depth, bin.by << depth, (bin.bx + 1) << depth, (bin.by + 1) << depth};
}

// Calls fn(cell, points of its four nodes) for every square of a bin with points; all points, on the finest lattice.
template <class Fn>
void for_each_square(const OrderedPoints::Bin& bin, const CellBox& box, const Fn& fn) {
  std::size_t at = 0;
  for_each_cell(box, [&](Cell c) {
    SquarePoints points;
    std::size_t all = 0;
    for (NodePoints& p : points) p = bin.node(at++), all += p.size;
    if (all > 0) fn(c, points);
  });
}

// Offsets from square centres, worked out anew on every level. Reused memory.
struct LowestScratch {
  std::vector<std::int16_t> x_mm, y_mm;
  std::vector<std::int32_t> z_mm;
};

// The same on a coarser lattice, of edge r_mm, with the lowest points only.
template <class Fn>
void for_each_square(const OrderedPoints::Lowest& bin, const NodeOrder& order, int depth, std::int32_t r_mm,
                     const CellBox& box, LowestScratch& s, const Fn& fn) {
  const std::vector<std::uint16_t>& numbers = order.numbers(depth);
  const int shift = 2 * (order.refinements() - depth);
  const std::size_t n = bin.points.size();
  if (s.x_mm.size() < n) {
    s.x_mm.resize(n);
    s.y_mm.resize(n);
    s.z_mm.resize(n);
  }
  std::size_t at = 0;
  for_each_cell(box, [&](Cell c) {
    SquarePoints points;
    std::size_t all = 0;
    const std::int32_t centre_x = (c.col - box.col0) * r_mm + r_mm / 2, centre_y = (c.row - box.row0) * r_mm + r_mm / 2;
    for (NodePoints& p : points) {
      const std::size_t first = std::size_t{numbers[at++]} << shift;
      const std::uint32_t begin = first == 0 ? 0 : bin.end[first - 1],
                          end = bin.end[first + (std::size_t{1} << shift) - 1];
      for (std::uint32_t i = begin; i < end; ++i) {
        s.x_mm[i] = static_cast<std::int16_t>(bin.points[i].x_mm - centre_x);
        s.y_mm[i] = static_cast<std::int16_t>(bin.points[i].y_mm - centre_y);
        s.z_mm[i] = bin.points[i].z_mm;
      }
      p = {s.x_mm.data() + begin, s.y_mm.data() + begin, s.z_mm.data() + begin, end - begin};
      all += p.size;
    }
    if (all > 0) fn(c, points);
  });
}

}  // namespace btms
