// The traversability graph field of a finished tile (paper II, Eq 6) as a route planner wants it.
//
// Nodes are the triangles whose final plane the map's vehicle can cross. Two of the lattice's neighbours are joined
// where their final planes are locally convex (Eq 6) and everything that the straight line between their centroids
// touches is a node, too: no way leads through the corner between two obstacles.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/lattice/neighbours.h"
#include "engine/model/terrain_tile.h"
#include "engine/terrain/local_convexity.h"

namespace btms {

// 16 bytes. Heights as FinalPlane has them.
struct GraphNode {
  std::int32_t centre_mm = 0, rise_x_mm = 0, rise_y_mm = 0;
  std::uint16_t edges = 0;              // bit n: joined with kNeighbourTable[triangle][n]
  std::uint8_t cost = kNotTraversable;  // of crossing it, in 1/254; kNotTraversable: not a node
  bool exists() const { return cost != kNotTraversable; }
};

// A centroid in thirds of a millimetre of the map frame: exact.
struct Centroid {
  std::int64_t x3 = 0, y3 = 0, z3 = 0;
};
Centroid centroid_of(NodeId id, const GraphNode& node, const Lattice& lattice);
// Metres.
double distance_m(const Centroid& a, const Centroid& b);

// The nodes of a tile, and copies of those one square around it, so that all edges of its own nodes can be weighed;
// edges over the border lead to nodes of the neighbouring tiles. An edge is a bit of its node, since only 14 others can
// be at its end. Immutable; depends on the map alone, not on how it is tiled.
class TileGraph {
 public:
  // `around`: the tiles that touch the tile, those there are, in any order.
  TileGraph(const TerrainTile& tile, std::span<const std::shared_ptr<const TerrainTile>> around,
            const ConvexityRules& rules);

  const CellBox& box() const { return box_; }  // of its own nodes
  const Lattice& lattice() const { return lattice_; }
  std::size_t memory_bytes() const { return sizeof *this + nodes_.capacity() * sizeof(GraphNode); }

  // nullptr where there is no node, or none of this tile or the ring around it.
  const GraphNode* find(NodeId id) const {
    if (!held_.contains(id.cell)) return nullptr;
    const GraphNode& node = nodes_[index(id)];
    return node.exists() ? &node : nullptr;
  }
  // fn(NodeId, const GraphNode&, weight) of all that a node is joined with, in ascending order. The weight, in metres:
  // the distance of the centroids times (1 + cost_weight times the mean of the two costs). Precondition: box() contains
  // the node.
  template <class Fn>
  void for_each_edge(NodeId from, double cost_weight, const Fn& fn) const {
    const GraphNode& a = nodes_[index(from)];
    const Centroid at = centroid_of(from, a, lattice_);
    for (std::size_t n = 0; n < kNeighbours; ++n) {
      if ((a.edges >> n & 1) == 0) continue;
      const NodeOffset& o = kNeighbourTable[from.triangle][n];
      const NodeId to{{from.cell.col + o.col, from.cell.row + o.row}, o.triangle};
      const GraphNode& b = nodes_[index(to)];
      const double mean_cost = (a.cost + b.cost) / (2 * 254.0);
      fn(to, b, distance_m(at, centroid_of(to, b, lattice_)) * (1 + cost_weight * mean_cost));
    }
  }

 private:
  std::size_t index(NodeId id) const {
    return static_cast<std::size_t>((std::int64_t{id.cell.row} - held_.row0) * held_.cols() +
                                    (id.cell.col - held_.col0)) *
               kTriangles +
           id.triangle;
  }
  void take(const TerrainTile& tile);
  void join(const ConvexityRules& rules);

  Lattice lattice_;
  CellBox box_, held_;
  std::vector<GraphNode> nodes_;  // of held_
};

}  // namespace btms
