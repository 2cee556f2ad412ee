// Who touches whom on the tri-grid, derived from shared corners at compile time (never typed by hand).
#pragma once

#include <array>
#include <cstdint>

#include "engine/lattice/lattice.h"

namespace btms {

// A triangle near a reference cell.
struct NodeOffset {
  std::int8_t col = 0;
  std::int8_t row = 0;
  std::uint8_t triangle = 0;
  friend constexpr bool operator==(const NodeOffset&, const NodeOffset&) = default;
};

inline constexpr int kNeighbours = 14;      // triangles sharing at least one corner with a triangle
inline constexpr int kIncidentLattice = 8;  // triangles around a lattice corner
inline constexpr int kIncidentCentre = 4;   // triangles around a centre corner

namespace detail {

constexpr bool shares_corner(std::uint8_t a, NodeOffset b) {
  for (const HalfCell& p : triangle_corners(a))
    for (const HalfCell& q : triangle_corners(b.triangle))
      if (p.x == q.x + 2 * b.col && p.y == q.y + 2 * b.row) return true;
  return false;
}

constexpr auto derive_neighbours() {
  std::array<std::array<NodeOffset, kNeighbours>, kTriangles> table{};
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    int n = 0;
    for (std::int8_t row = -1; row <= 1; ++row)
      for (std::int8_t col = -1; col <= 1; ++col)
        for (std::uint8_t u = 0; u < kTriangles; ++u) {
          const NodeOffset b{col, row, u};
          if (b == NodeOffset{0, 0, t} || !shares_corner(t, b)) continue;
          table[t].at(n++) = b;  // a 15th neighbour would not compile
        }
  }
  return table;
}

constexpr auto derive_incident() {
  std::array<NodeOffset, kIncidentLattice> table{};
  int n = 0;
  for (std::int8_t row = -1; row <= 0; ++row)
    for (std::int8_t col = -1; col <= 0; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t)
        for (const HalfCell& c : triangle_corners(t))
          if (c.x + 2 * col == 0 && c.y + 2 * row == 0) table.at(n++) = {col, row, t};
  return table;
}

}  // namespace detail

// kNeighbourTable[t]: the neighbours of triangle t in ascending (row, col, triangle), i.e. ascending key.
inline constexpr auto kNeighbourTable = detail::derive_neighbours();
// The triangles around the lattice corner A of a cell, ascending: the fixed summation order of corner sums.
inline constexpr auto kIncidentTable = detail::derive_incident();

}  // namespace btms
