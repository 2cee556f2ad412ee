// Maps for tests of routes, drawn or made up, cut into tiles of any size.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/model/memory_map.h"
#include "engine/routing/graph.h"

namespace btms::test {

struct MapMaker {
  CellBox box;
  std::function<std::int32_t(HalfCell)> height_mm = [](HalfCell) { return 0; };  // of a corner
  std::function<std::uint8_t(NodeId)> cost = [](NodeId) { return std::uint8_t{0}; };

  std::shared_ptr<const MemoryMap> cut(std::int32_t edge_cells, Cell origin = {}) const {
    const MapLayout layout{Lattice(2000), {edge_cells, origin}};
    auto map = std::make_shared<MemoryMap>(layout);
    layout.grid.for_each_tile(box, [&](TileId id) {
      TerrainTile tile(2000, layout.grid.box_of(id).intersect(box));
      for (std::int32_t row = tile.box.row0; row <= tile.box.row1; ++row)
        for (std::int32_t col = tile.box.col0; col <= tile.box.col1; ++col) {
          tile.corner_mm[tile.corner_index({col, row})] = height_mm({2 * col, 2 * row});
          if (!tile.box.contains({col, row})) continue;
          tile.centre_mm[tile.cell_index({col, row})] = height_mm({2 * col + 1, 2 * row + 1});
          for (std::uint8_t t = 0; t < kTriangles; ++t) {
            const NodeId id_of{{col, row}, t};
            NodeSurface& node = tile.nodes[tile.node_index(id_of)];
            node.cost = cost(id_of);
            node.state = node.cost == kNotTraversable ? NodeState::kObstacle : NodeState::kObserved;
          }
        }
      map->put(id, std::move(tile));
    });
    return map;
  }
};

// Squares of level ground from south (last row) to north: '#' cannot be crossed, a digit n costs n / 9.
inline MapMaker drawn(const std::vector<std::string>& rows) {
  MapMaker maker;
  maker.box = {0, 0, static_cast<std::int32_t>(rows[0].size()), static_cast<std::int32_t>(rows.size())};
  maker.cost = [rows](NodeId id) {
    const char c = rows[rows.size() - 1 - static_cast<std::size_t>(id.cell.row)][static_cast<std::size_t>(id.cell.col)];
    return c == '#' ? kNotTraversable : static_cast<std::uint8_t>(c == '.' ? 0 : (c - '0') * 254 / 9);
  };
  return maker;
}

// Rolling ground of random costs with holes, in all four quadrants.
inline MapMaker rolling() {
  MapMaker maker;
  maker.box = {-37, -29, 41, 35};
  maker.height_mm = [](HalfCell h) {
    return static_cast<std::int32_t>(900 * std::sin(h.x / 9.0) + 700 * std::cos(h.y / 7.0) +
                                     (h.x * h.x * 7 + h.y * 13) % 180);
  };
  maker.cost = [](NodeId id) {
    const auto hash = (static_cast<std::uint64_t>(node_key(id)) * 0x9E3779B97F4A7C15ull) >> 40;
    return hash % 17 == 0 ? kNotTraversable : static_cast<std::uint8_t>(hash % 200);
  };
  return maker;
}

inline TraversalGraph graph_of(const MapMaker& maker, std::int32_t edge_cells,
                               std::size_t budget_bytes = kDefaultGraphs_bytes) {
  return TraversalGraph(Terrain(maker.cut(edge_cells)), preset("city"), budget_bytes);
}

}  // namespace btms::test
