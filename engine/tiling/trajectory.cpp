#include "engine/tiling/trajectory.h"

namespace btms {

PassagesByTile::PassagesByTile(const std::vector<TrajectoryPoint>& trajectory, const TileTable& table)
    : by_tile_(table.tiles().size()) {
  const Lattice lattice = table.layout().lattice;
  for (const TrajectoryPoint& p : trajectory) {
    const NodeId node = lattice.node_at(p.x_mm, p.y_mm);
    const std::int32_t i = table.index_of(table.layout().grid.tile_of(node.cell));
    const auto tile = static_cast<std::size_t>(i);
    if (i < 0 || !table.tiles()[tile].box.contains(node.cell)) continue;
    by_tile_[tile].push_back({node, static_cast<std::int32_t>(p.x_mm - lattice.centre_x_mm(node.cell)),
                              static_cast<std::int32_t>(p.y_mm - lattice.centre_y_mm(node.cell)), p.z_mm});
  }
}

}  // namespace btms
