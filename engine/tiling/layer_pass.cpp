// Layers that follow from the finished surface alone: step and cost.
#include <algorithm>

#include "engine/model/traversability.h"
#include "engine/tiling/finished_tiles.h"
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

// The heights of a tile and its halo as rasters, counted from the lowest; 0 where there is none.
class HeightRasters {
 public:
  explicit HeightRasters(const TileField<NodeCorners>& corners)
      : box_(corners.held()),
        corner_mm_(static_cast<std::size_t>((box_.rows() + 1) * (box_.cols() + 1)), kUnknownHeight_mm),
        centre_mm_(static_cast<std::size_t>(box_.cells()), kUnknownHeight_mm) {
    const auto put = [](std::int32_t& to, std::int32_t z_mm) { to = std::max(to, z_mm); };  // unknown is the least
    for (std::int32_t row = box_.row0; row < box_.row1; ++row)
      for (std::int32_t col = box_.col0; col < box_.col1; ++col) {
        const NodeCorners* cell = corners.cell({col, row});
        const std::size_t a = corner({col, row}), d = corner({col, row + 1});
        put(centre_mm_[centre({col, row})], cell[kSouth].mm[0]);
        put(corner_mm_[a], cell[kSouth].mm[1]);
        put(corner_mm_[a + 1], cell[kSouth].mm[2]);
        put(corner_mm_[d + 1], cell[kNorth].mm[1]);
        put(corner_mm_[d], cell[kNorth].mm[2]);
      }
    std::int32_t low = INT32_MAX, high = INT32_MIN;
    for (const auto* heights : {&corner_mm_, &centre_mm_})
      for (const std::int32_t z : *heights) {
        low = std::min(low, z == kUnknownHeight_mm ? INT32_MAX : z);
        high = std::max(high, z);
      }
    relief_mm_ = std::int64_t{high} - low;
    for (auto* heights : {&corner_mm_, &centre_mm_})
      for (std::int32_t& z : *heights) z = z == kUnknownHeight_mm ? 0 : z - low;
  }
  std::int64_t relief_mm() const { return relief_mm_; }
  // Around the squares of a row from `first` on.
  HeightRows around(Cell first) const {
    HeightRows rows;
    for (std::int32_t k = 0; k < 4; ++k)
      rows.corner_mm[static_cast<std::size_t>(k)] = &corner_mm_[corner({first.col - 1, first.row + k - 1})];
    for (std::int32_t k = 0; k < 3; ++k)
      rows.centre_mm[static_cast<std::size_t>(k)] = &centre_mm_[centre({first.col - 1, first.row + k - 1})];
    return rows;
  }

 private:
  std::size_t corner(Cell c) const {
    return static_cast<std::size_t>((std::int64_t{c.row} - box_.row0) * (box_.cols() + 1) + (c.col - box_.col0));
  }
  std::size_t centre(Cell c) const {
    return static_cast<std::size_t>((std::int64_t{c.row} - box_.row0) * box_.cols() + (c.col - box_.col0));
  }
  CellBox box_;
  std::vector<std::int32_t> corner_mm_, centre_mm_;
  std::int64_t relief_mm_ = 0;
};

// Steps of whole rows, where nothing around is unknown. Marks the other squares.
void find_steps_inside(const TileField<NodeCorners>& corners, SquareMask& others, TerrainTile& tile) {
  const HeightRasters heights(corners);
  if (heights.relief_mm() >= kMostStepRelief_mm) return std::fill(others.flags.begin(), others.flags.end(), 1);
  StepRow steps;
  for (std::int32_t row = tile.box.row0; row < tile.box.row1; ++row) {
    const Cell first{tile.box.col0, row};
    const std::uint8_t* other = &others.at(first.col, row);
    const auto cols = static_cast<std::size_t>(tile.box.cols());
    if (std::find(other, other + cols, 0) == other + cols) continue;
    for (std::uint8_t t = 0; t < kTriangles; ++t) {
      const auto row_steps = steps.of(t, heights.around(first), cols);
      NodeSurface* node = &tile.nodes[tile.node_index({first, t})];
      for (std::size_t i = 0; i < cols; ++i)
        if (!other[i]) node[i * kTriangles].step_mm = row_steps[i];
    }
  }
}

void find_steps(const TileField<NodeCorners>& corners, TerrainTile& tile) {
  SquareMask unknown(corners.held());
  for (std::int32_t row = unknown.box.row0; row < unknown.box.row1; ++row)
    for (std::int32_t col = unknown.box.col0; col < unknown.box.col1; ++col) {
      const NodeCorners* cell = corners.cell({col, row});
      unknown.at(col, row) = !std::all_of(cell, cell + kTriangles, [](const NodeCorners& n) { return n.known(); });
    }
  SquareMask others = unknown.dilated(kStepHalo);
  find_steps_inside(corners, others, tile);
  // Where the neighbours of a node lie from the first node of its square.
  std::array<std::array<std::ptrdiff_t, kNeighbours>, kTriangles> places;
  for (std::size_t t = 0; t < kTriangles; ++t)
    for (std::size_t k = 0; k < kNeighbours; ++k) {
      const NodeOffset o = kNeighbourTable[t][k];
      places[t][k] = (o.row * static_cast<std::ptrdiff_t>(corners.held().cols()) + o.col) * kTriangles + o.triangle;
    }
  std::array<const NodeCorners*, kNeighbours> around;
  for_each_node(tile.box, [&](NodeId n) {
    if (!others.at(n.cell.col, n.cell.row)) return;
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

void layer_pass(const PassContext& context, FinalTiles& finished) {
  const TileTable& table = context.table;
  const auto& tiles = table.tiles();
  const Vehicle vehicle(context.parameters);
  // Steps follow from the corners around, costs from what is under the vehicle.
  const TileSet stepped = within(table, finished.made(), kStepHalo), around = within(table, stepped, kStepHalo);
  const TileSet costed = within(table, finished.made(), kStepHalo + vehicle.rings());
  TileSet looked_at = within(table, costed, vehicle.rings());
  add(looked_at, around);
  finished.need(looked_at, context);

  TileFields<NodeCorners> corners(context.pager, tiles.size());
  context.on(around).for_each_tile("layers", {reads(finished.values), writes(corners)}, [&](std::size_t i, int) {
    corners[i] = TileField<NodeCorners>(tiles[i].box, kStepHalo);
    copy_corners(finished.values[i], corners[i]);
  });
  exchange_halo(table, corners, kStepHalo, context.threads, context.ranks, &stepped);

  TileFields<OwnCost> costs(context.pager, tiles.size());
  context.on(looked_at).for_each_tile("layers", {writes(finished.values), writes(corners), writes(costs)},
                                      [&](std::size_t i, int) {
                                        if (stepped[i]) find_steps(corners[i], finished.values[i]);
                                        corners[i] = {};
                                        costs[i] = TileField<OwnCost>(tiles[i].box, vehicle.rings());
                                        find_own_costs(finished.values[i], vehicle, costs[i]);
                                      });
  exchange_halo(table, costs, vehicle.rings(), context.threads, context.ranks, &costed);
  context.on(costed).for_each_tile("layers", {writes(finished.values), reads(costs)},
                                   [&](std::size_t i, int) { spread_costs(costs[i], vehicle, finished.values[i]); });
}

}  // namespace btms
