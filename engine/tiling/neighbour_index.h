// Which squares with observed terrain lie near a place: a nanoflann kd-tree over one tile's interior and halo, or a
// scan of the lattice that finds the same squares. Either only proposes candidates; the kernel's exact distance test
// decides.
//
// The tree holds one point per square (four nodes), and only squares within reach of a square that needs a prediction;
// it is asked once per group of squares. Measured against one point a node and one query a node, that costs a fifth.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "engine/lattice/tiles.h"

namespace btms {

class NeighbourIndex {
 public:
  virtual ~NeighbourIndex() = default;
  // Wanted squares, at least all those with a node within the kernel of any node of the group whose south-west square
  // is `corner`. Order is not defined. The vector is reused memory.
  virtual void near(Cell corner, std::vector<Cell>& squares) = 0;
};

// `wanted[k]` marks the squares of `held` (row by row) that hold terrain a query may have to find; it must outlive the
// index. `reach_cells` = l / r; a group is `group` x `group` squares.
std::unique_ptr<NeighbourIndex> nanoflann_index(const CellBox& held, const std::vector<std::uint8_t>& wanted,
                                                double reach_cells, std::int32_t group);
std::unique_ptr<NeighbourIndex> lattice_index(const CellBox& held, const std::vector<std::uint8_t>& wanted,
                                              std::int32_t reach_rings, std::int32_t group);

}  // namespace btms
