// rolling_map() with a bit of every hazard in it, cut into tiles of any edge.
#pragma once

#include <algorithm>
#include <map>

#include "tests/engine/query/query_map.h"

namespace btms::test {

// Squares [0, 48) both ways; one block of 5 x 3 squares in the middle is not there.
inline std::shared_ptr<MemoryMap> hazard_map(std::int32_t edge_cells) {
  const MemoryMap rolling = rolling_map(3);
  const TileGrid grid{edge_cells, {}};
  auto map = std::make_shared<MemoryMap>(MapLayout{Lattice(2000), grid});
  const CellBox whole{0, 0, 48, 48};
  grid.for_each_tile(whole, [&](TileId id) {
    TerrainTile tile(2000, grid.box_of(id).intersect(whole));
    for (const TileId from : rolling.tiles()) {
      const auto part = rolling.load(from);
      const CellBox shared = part->box.intersect(tile.box);
      for (std::int32_t row = shared.row0; row <= shared.row1 && !shared.empty(); ++row)
        for (std::int32_t col = shared.col0; col <= shared.col1; ++col) {
          tile.corner_mm[tile.corner_index({col, row})] = part->corner_mm[part->corner_index({col, row})];
          if (!shared.contains({col, row})) continue;
          tile.centre_mm[tile.cell_index({col, row})] = part->centre_mm[part->cell_index({col, row})];
          for (std::uint8_t t = 0; t < kTriangles; ++t) {
            NodeSurface& node = tile.nodes[tile.node_index({{col, row}, t})];
            node = part->nodes[part->node_index({{col, row}, t})];
            Random random(node_key({{col, row}, t}));
            const auto dice = random.between(0, 99);
            if (node.state == NodeState::kUnknown) continue;
            if (dice < 4) node.state = NodeState::kObstacle;
            if (dice == 5) node.state = NodeState::kFilled;
            if (dice > 80) node.clearance_mm = static_cast<std::uint16_t>(random.between(500, 9000));
            node.step_mm = static_cast<std::uint16_t>(dice > 70 ? node.step_mm : node.step_mm / 8);
          }
        }
    }
    map->put(id, std::move(tile));
  });
  return map;
}

}  // namespace btms::test
