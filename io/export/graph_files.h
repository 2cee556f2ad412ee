// The traversability graph of a map, or a part of it, for planners: GeoJSON for looking at it and for programs that
// read nothing else; a compact binary form (docs/exports.md has the table) of 16 bytes a node, edges included.
#pragma once

#include <cstdint>
#include <filesystem>

#include "engine/routing/graph.h"
#include "io/store/map_store.h"

namespace btms {

struct GraphSize {
  std::uint64_t nodes = 0, edges = 0;  // an edge joins two nodes, once
};

// Nodes whose squares lie in `box` (of the finest level), and the edges between them; both in an order that depends on
// the map alone. Tile after tile: memory holds what `graph` keeps. Weights are those of a search with `cost_weight`.
// Throw Error(kUsage) when there is no node, Error(kFailed), what graph.tile() throws.
GraphSize write_graph_geojson(const MapReader& map, const TraversalGraph& graph, const CellBox& box, double cost_weight,
                              const std::filesystem::path& path);
GraphSize write_graph(const MapReader& map, const TraversalGraph& graph, const CellBox& box,
                      const std::filesystem::path& path);

}  // namespace btms
