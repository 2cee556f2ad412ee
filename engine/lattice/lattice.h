// The tri-grid (paper II-A, Eq 1; TGF): squares of edge r, each cut by its two diagonals into four triangles. A
// triangle is a node. The squares are anchored at absolute multiples of r in the map frame, never at the data's
// minimum, so a node has the same key whatever else is in the map.
//
//        y
//        ^   D-----C        corners A, B, C, D are shared lattice corners,
//        |   |\ N /|        M is the square's centre corner.
//        |   |W M E|        E = MBC, N = MCD, W = MDA, S = MAB (0..3)
//        |   |/ S \|
//            A-----B  -> x
//
// Triangle rule: with u, v from the centre, p = u+v < 0, q = u-v < 0, triangle = 2p | (p^q). Cells are half-open.
// With this rule every triangle of a lattice lies in exactly one triangle of the lattice with twice the edge (4 to 1).
//
// Everything here is integer arithmetic on int64 millimetres: exact, total, thread-safe.
#pragma once

#include <array>
#include <compare>
#include <cstdint>

#include "engine/lattice/coordinates.h"

namespace btms {

enum Triangle : std::uint8_t { kEast = 0, kNorth = 1, kWest = 2, kSouth = 3 };
inline constexpr int kTriangles = 4;

// A square of the lattice: column (x) and row (y) index, each within +-2^30.
struct Cell {
  std::int32_t col = 0;
  std::int32_t row = 0;
  friend constexpr auto operator<=>(const Cell&, const Cell&) = default;
};

// One node: a triangle of a cell.
struct NodeId {
  Cell cell;
  std::uint8_t triangle = 0;
  friend constexpr auto operator<=>(const NodeId&, const NodeId&) = default;
};

// 64-bit key of a node: (row + 2^30) << 33 | (col + 2^30) << 2 | triangle. Ascending keys go row by row.
using NodeKey = std::uint64_t;
inline constexpr std::int64_t kCellBias = std::int64_t{1} << 30;

constexpr NodeKey node_key(NodeId n) {
  return (static_cast<NodeKey>(n.cell.row + kCellBias) << 33) | (static_cast<NodeKey>(n.cell.col + kCellBias) << 2) |
         n.triangle;
}
constexpr NodeId node_of_key(NodeKey key) {
  return {{static_cast<std::int32_t>(static_cast<std::int64_t>((key >> 2) & 0x7fffffff) - kCellBias),
           static_cast<std::int32_t>(static_cast<std::int64_t>(key >> 33) - kCellBias)},
          static_cast<std::uint8_t>(key & 3)};
}

// Triangle of the offset (u2, v2) from a square's centre, in any unit (here: half millimetres).
constexpr std::uint8_t triangle_of(std::int64_t u2, std::int64_t v2) {
  const unsigned p = u2 + v2 < 0, q = u2 - v2 < 0;
  return static_cast<std::uint8_t>(2 * p | (p ^ q));
}

// The same of offsets below 2^30: loops over it vectorise.
constexpr std::uint8_t triangle_of(std::int32_t u2, std::int32_t v2) {
  const unsigned p = u2 + v2 < 0, q = u2 - v2 < 0;
  return static_cast<std::uint8_t>(2 * p | (p ^ q));
}

// The position of a corner in half cells: lattice corners are even, centre corners odd in both coordinates.
struct HalfCell {
  std::int32_t x = 0;
  std::int32_t y = 0;
  friend constexpr auto operator<=>(const HalfCell&, const HalfCell&) = default;
};

// The three corners of a node, relative to its cell's corner A in half cells: centre, then counter-clockwise.
constexpr std::array<HalfCell, 3> triangle_corners(std::uint8_t triangle) {
  constexpr HalfCell A{0, 0}, B{2, 0}, C{2, 2}, D{0, 2}, M{1, 1};
  switch (triangle) {
    case kEast:
      return {M, B, C};
    case kNorth:
      return {M, C, D};
    case kWest:
      return {M, D, A};
    default:
      return {M, A, B};
  }
}

// A lattice of one resolution. r is an even number of millimetres so that centres are whole millimetres; levels of a
// map are lattices whose r halves from one to the next.
class Lattice {
 public:
  static constexpr std::int32_t kMinResolution_mm = 100;
  static constexpr std::int32_t kMaxResolution_mm = 65534;  // offsets from the centre fit int16

  // Precondition: kMin <= r_mm <= kMax, even (parameters.h checks and reports).
  explicit constexpr Lattice(std::int32_t r_mm) : r_mm_(r_mm) {}

  constexpr std::int32_t resolution_mm() const { return r_mm_; }
  constexpr double resolution_m() const { return r_mm_ / 1000.0; }
  constexpr Lattice finer() const { return Lattice(r_mm_ / 2); }

  constexpr Cell cell_at(std::int64_t x_mm, std::int64_t y_mm) const {
    return {static_cast<std::int32_t>(floor_div(x_mm, r_mm_)), static_cast<std::int32_t>(floor_div(y_mm, r_mm_))};
  }
  constexpr NodeId node_at(std::int64_t x_mm, std::int64_t y_mm) const {
    const Cell c = cell_at(x_mm, y_mm);
    return {c, triangle_of(2 * (x_mm - std::int64_t{c.col} * r_mm_) - r_mm_,
                           2 * (y_mm - std::int64_t{c.row} * r_mm_) - r_mm_)};
  }
  constexpr std::int64_t centre_x_mm(Cell c) const { return std::int64_t{c.col} * r_mm_ + r_mm_ / 2; }
  constexpr std::int64_t centre_y_mm(Cell c) const { return std::int64_t{c.row} * r_mm_ + r_mm_ / 2; }

  friend constexpr bool operator==(const Lattice&, const Lattice&) = default;

 private:
  std::int32_t r_mm_;
};

// Centroid x_i of a node relative to its square's centre, in thirds of a millimetre (exact): +-r along one axis.
constexpr std::int64_t centroid_x3(std::uint8_t t, std::int64_t r_mm) {
  return t == kEast ? r_mm : t == kWest ? -r_mm : 0;
}
constexpr std::int64_t centroid_y3(std::uint8_t t, std::int64_t r_mm) {
  return t == kNorth ? r_mm : t == kSouth ? -r_mm : 0;
}

// The node of the lattice of edge 2r that holds a node of the lattice of edge r.
constexpr NodeId parent(NodeId n) {
  const Cell coarse{static_cast<std::int32_t>(floor_div(n.cell.col, 2)),
                    static_cast<std::int32_t>(floor_div(n.cell.row, 2))};
  // The fine centroid in sixths of the fine edge, relative to the coarse centre: never on a coarse diagonal.
  const std::int64_t u = 6 * (n.cell.col - 2 * std::int64_t{coarse.col}) + 3 + centroid_x3(n.triangle, 2) - 6;
  const std::int64_t v = 6 * (n.cell.row - 2 * std::int64_t{coarse.row}) + 3 + centroid_y3(n.triangle, 2) - 6;
  return {coarse, triangle_of(u, v)};
}

}  // namespace btms
