// Layers that follow from the finished surface alone: step and cost.
#include <algorithm>

#include "engine/model/traversability.h"
#include "engine/tiling/needy_walk.h"
#include "engine/tiling/passes.h"

namespace btms {
namespace {

// Cost of a node by itself.
struct OwnCost {
  std::uint8_t value = kNotTraversable;
};

template <class Fn>
void for_each_node(const CellBox& box, const Fn& fn) {
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for (std::int32_t col = box.col0; col < box.col1; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) fn(NodeId{{col, row}, t});
}

void copy_corners(const TerrainTile& tile, TileField<NodeCorners>& corners) {
  for_each_node(tile.box, [&](NodeId n) {
    if (tile.nodes[tile.node_index(n)].state != NodeState::kUnknown)
      corners.cell(n.cell)[n.triangle].mm = tile.corners_mm(n);
  });
}

void find_steps(const TileField<NodeCorners>& corners, TerrainTile& tile) {
  // Where the neighbours of a node lie from the first node of its square.
  std::array<std::array<std::ptrdiff_t, kNeighbours>, kTriangles> places;
  for (std::size_t t = 0; t < kTriangles; ++t)
    for (std::size_t k = 0; k < kNeighbours; ++k) {
      const NodeOffset o = kNeighbourTable[t][k];
      places[t][k] = (o.row * static_cast<std::ptrdiff_t>(corners.held().cols()) + o.col) * kTriangles + o.triangle;
    }
  std::array<const NodeCorners*, kNeighbours> around;
  for_each_node(tile.box, [&](NodeId n) {
    const NodeCorners* cell = corners.cell(n.cell);
    if (!cell[n.triangle].known()) return;
    for (std::size_t k = 0; k < kNeighbours; ++k) around[k] = cell + places[n.triangle][k];
    tile.nodes[tile.node_index(n)].step_mm = step_mm(n.triangle, cell[n.triangle], around);
  });
}

void find_own_costs(const TerrainTile& tile, const Vehicle& vehicle, TileField<OwnCost>& costs) {
  for_each_node(tile.box, [&](NodeId n) {
    const NodeSurface& node = tile.nodes[tile.node_index(n)];
    if (node.state != NodeState::kUnknown)
      costs.cell(n.cell)[n.triangle].value = vehicle.cost(node, FinalPlane::through(n.triangle, tile.corners_mm(n)));
  });
}

// All that lies under the vehicle has to be traversable.
void spread_costs(const TileField<OwnCost>& costs, const Vehicle& vehicle, TerrainTile& tile) {
  const CellBox& held = costs.held();
  SquareMask blocked(held);
  for (std::int32_t row = held.row0; row < held.row1; ++row)
    for (std::int32_t col = held.col0; col < held.col1; ++col) {
      const OwnCost* cell = costs.cell({col, row});
      blocked.at(col, row) = std::any_of(cell, cell + kTriangles, [](OwnCost c) { return c.value == kNotTraversable; });
    }
  const SquareMask near_blocked = blocked.dilated(vehicle.rings());
  for_each_node(tile.box, [&](NodeId n) {
    NodeSurface& node = tile.nodes[tile.node_index(n)];
    node.cost = costs.cell(n.cell)[n.triangle].value;
    if (node.cost == kNotTraversable || !near_blocked.at(n.cell.col, n.cell.row)) return;
    const auto& under = vehicle.footprint(n.triangle);
    if (std::any_of(under.begin(), under.end(), [&](const NodeOffset& o) {
          return costs.cell({n.cell.col + o.col, n.cell.row + o.row})[o.triangle].value == kNotTraversable;
        }))
      node.cost = kNotTraversable;
  });
}

}  // namespace

void layer_pass(const PassContext& context, FinishedTiles& finished) {
  const auto& tiles = context.table.tiles();
  TileFields<NodeCorners> corners(context.pager, tiles.size());
  context.for_each_tile("layers", {reads(finished), writes(corners)}, [&](std::size_t i, int) {
    corners[i] = TileField<NodeCorners>(tiles[i].box, kStepHalo);
    copy_corners(finished[i], corners[i]);
  });
  exchange_halo(context.table, corners, kStepHalo, context.threads, context.ranks);

  const Vehicle vehicle(context.parameters);
  const std::int32_t cost_halo = vehicle.rings();
  TileFields<OwnCost> costs(context.pager, tiles.size());
  context.for_each_tile("layers", {writes(finished), writes(corners), writes(costs)}, [&](std::size_t i, int) {
    find_steps(corners[i], finished[i]);
    corners[i] = {};
    costs[i] = TileField<OwnCost>(tiles[i].box, cost_halo);
    find_own_costs(finished[i], vehicle, costs[i]);
  });
  exchange_halo(context.table, costs, cost_halo, context.threads, context.ranks);
  context.for_each_tile("layers", {writes(finished), reads(costs)},
                        [&](std::size_t i, int) { spread_costs(costs[i], vehicle, finished[i]); });
}

}  // namespace btms
