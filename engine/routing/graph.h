// The traversal graph of a finished map: the paper's tri-grid graph (II, Eq 6) on the final surface.
//
// Nodes are the triangles that the vehicle of the map can cross (their stored cost says so); an edge joins two that
// share a corner and are locally convex, lcc(e_ij) of Eq 6 with their final planes and m at the centroids. A map has
// one graph, whatever its tiles.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "engine/lattice/neighbours.h"
#include "engine/query/terrain.h"
#include "engine/terrain/parameters.h"

namespace btms {

// kBackwards[t][k]: in whose place the node itself stands among the neighbours of its k-th neighbour.
inline constexpr auto kBackwards = [] {
  std::array<std::array<std::uint8_t, kNeighbours>, kTriangles> table{};
  for (std::uint8_t t = 0; t < kTriangles; ++t)
    for (std::uint8_t k = 0; k < kNeighbours; ++k) {
      const NodeOffset to = kNeighbourTable[t][k];
      for (std::uint8_t b = 0; b < kNeighbours; ++b) {
        const NodeOffset back = kNeighbourTable[to.triangle][b];
        if (back.triangle == t && back.col == -to.col && back.row == -to.row) table[t][k] = b;
      }
    }
  return table;
}();

constexpr NodeId neighbour(NodeId n, std::uint8_t k) {
  const NodeOffset o = kNeighbourTable[n.triangle][k];
  return {{n.cell.col + o.col, n.cell.row + o.row}, o.triangle};
}

// The graph inside one tile. Edges over its border lead to nodes of the tiles around: they are in both tiles.
struct TileGraph {
  CellBox box;
  // Of every node, in the order of TerrainTile::node_index():
  std::vector<std::uint16_t> edges;  // bit k: to the k-th neighbour
  std::vector<std::int32_t> z_mm;    // of the surface at the centroid
  std::vector<std::uint8_t> cost;    // 0 free .. 254, kNotTraversable: no node of the graph

  std::size_t index(NodeId n) const {
    return static_cast<std::size_t>((std::int64_t{n.cell.row} - box.row0) * box.cols() + (n.cell.col - box.col0)) *
               kTriangles +
           n.triangle;
  }
  std::size_t bytes() const { return edges.size() * 2 + z_mm.size() * 4 + cost.size(); }
};

// Thread-safe. Tiles' graphs are worked out on demand, from the tile and one ring of squares around it, and kept within
// a budget.
class TraversalGraph {
 public:
  TraversalGraph(Terrain terrain, const Parameters& parameters, std::size_t budget_bytes = std::size_t{128} << 20);

  const Terrain& terrain() const { return terrain_; }
  // nullptr where the map has no tile. Throws what loading a tile throws.
  std::shared_ptr<const TileGraph> tile(TileId id) const;
  // The same, always worked out.
  TileGraph make(TileId id) const;

 private:
  using Entry = std::pair<TileId, std::shared_ptr<const TileGraph>>;
  const Terrain terrain_;
  const Parameters parameters_;
  const std::size_t budget_bytes_;
  mutable std::mutex mutex_;  // guards what follows
  mutable std::list<Entry> recent_;
  mutable std::unordered_map<TileId, std::list<Entry>::iterator, TileIdHash> at_;
  mutable std::size_t bytes_ = 0;
};

}  // namespace btms
