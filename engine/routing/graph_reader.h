// A graph as one search walks over it: the tiles it was at last are at hand without a lock.
#pragma once

#include <array>
#include <memory>

#include "engine/routing/graph.h"

namespace btms {

// Not thread-safe; one for each search.
class GraphReader {
 public:
  explicit GraphReader(const TraversalGraph& graph) : graph_(graph) {}

  const MapLayout& layout() const { return graph_.layout(); }
  // The graph that owns the square; nullptr where there is none. Valid until the next call.
  const TileGraph* at(Cell cell) {
    const TileId id = layout().grid.tile_of(cell);
    Recent& recent = recent_[static_cast<std::size_t>((id.tx & 3) | (id.ty & 3) << 2)];
    if (!recent.known || recent.id != id) recent = {id, true, graph_.tile(id)};
    return recent.graph && recent.graph->box().contains(cell) ? recent.graph.get() : nullptr;
  }
  // nullptr where there is no node.
  const GraphNode* find(NodeId id) {
    const TileGraph* graph = at(id.cell);
    return graph ? graph->find(id) : nullptr;
  }

 private:
  struct Recent {
    TileId id;
    bool known = false;
    std::shared_ptr<const TileGraph> graph;
  };
  const TraversalGraph& graph_;
  std::array<Recent, 16> recent_;
};

}  // namespace btms
