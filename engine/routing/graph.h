// The graph of a whole map: its tiles' graphs, worked out when they are asked for and kept within a budget.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "engine/query/terrain.h"
#include "engine/routing/tile_graph.h"

namespace btms {

inline constexpr std::size_t kDefaultGraphs_bytes = std::size_t{128} << 20;

// Of one revision. Thread-safe; two threads may work out the same tile at the same time. The graph of a tile is made
// from the tile and those that touch it, about 1 MB for 128 x 128 squares.
class TraversalGraph {
 public:
  // `parameters`: those of the map, for Eq 6. At least the tile asked for last is kept whatever the budget.
  TraversalGraph(Terrain terrain, const Parameters& parameters, std::size_t budget_bytes = kDefaultGraphs_bytes);

  const Terrain& terrain() const { return terrain_; }
  const MapLayout& layout() const { return terrain_.layout(); }
  // nullptr where the map has no such tile. Throws Error(kVerification) when a tile is damaged.
  std::shared_ptr<const TileGraph> tile(TileId id) const;

 private:
  struct Kept {
    TileId id;
    std::shared_ptr<const TileGraph> graph;
  };
  std::shared_ptr<const TileGraph> make(TileId id) const;

  const Terrain terrain_;
  const ConvexityRules rules_;
  const std::size_t budget_bytes_;
  mutable std::mutex mutex_;      // guards what follows
  mutable std::list<Kept> kept_;  // what was asked for last first
  mutable std::unordered_map<TileId, std::list<Kept>::iterator, TileIdHash> where_;
  mutable std::size_t bytes_ = 0;
};

}  // namespace btms
