// Edges between the nodes of a level, a row of squares at a time: what compare() (level_links.h) says, four at once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/lattice/neighbours.h"
#include "engine/terrain/level_fit.h"
#include "engine/terrain/level_node.h"

namespace btms {

// The neighbours with a larger key, in ascending order: every edge once.
struct ForwardNeighbours {
  std::array<NodeOffset, kNeighbours> offset{};
  int count = 0;
};
inline constexpr auto kForwardTable = [] {
  std::array<ForwardNeighbours, kTriangles> table{};
  for (std::uint8_t t = 0; t < kTriangles; ++t)
    for (const NodeOffset& o : kNeighbourTable[t])
      if (o.row > 0 || (o.row == 0 && (o.col > 0 || (o.col == 0 && o.triangle > t))))
        table[t].offset[static_cast<std::size_t>(table[t].count++)] = o;
  return table;
}();

// The edges of a node to its forward neighbours, a bit each; none where either has no plane.
struct ForwardEdges {
  std::uint16_t linked = 0;
  std::uint16_t above = 0, below = 0;  // the node stands above or below the neighbour by more than a step
};

// A row of squares as lanes want it. Memory that is used again.
class NodeRow {
 public:
  // `squares`: four nodes each.
  void assign(std::span<const LevelNode> squares);

 private:
  friend class EdgeRules;
  struct Nodes {  // of one triangle
    std::vector<double> x_mm, y_mm, z_mm, slope_x, slope_y, slope;
  };
  std::array<Nodes, kTriangles> nodes_;
};

class EdgeRules {
 public:
  explicit EdgeRules(const LevelRules& rules);
  // Of the nodes of a row without its first and last square; `north` is the row above it. Square by square into `out`.
  void compare(const NodeRow& row, const NodeRow& north, std::span<ForwardEdges> out) const;

 private:
  double r_mm_, near_mm_, bend_, flat_mm_, step_m_, step_per_slope_;
};

}  // namespace btms
