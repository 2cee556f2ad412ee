#include "engine/model/surface.h"

#include <cmath>

#include "engine/lattice/plane.h"

namespace btms {

SurfacePoint surface_in(const TerrainTile& tile, std::int64_t x_mm, std::int64_t y_mm) {
  const Lattice lattice(tile.resolution_mm);
  const NodeId id = lattice.node_at(x_mm, y_mm);
  const NodeSurface& node = tile.nodes[tile.node_index(id)];
  SurfacePoint out;
  out.state = node.state;
  out.count = node.count;
  if (node.state == NodeState::kUnknown) return out;
  const FinalPlane plane = FinalPlane::through(id.triangle, tile.corners_mm(id));
  const double r = tile.resolution_mm;
  const double gx = static_cast<double>(plane.rise_x_mm) / r, gy = static_cast<double>(plane.rise_y_mm) / r;
  const double dx = static_cast<double>(x_mm - lattice.centre_x_mm(id.cell));
  const double dy = static_cast<double>(y_mm - lattice.centre_y_mm(id.cell));
  out.z_m = (static_cast<double>(plane.centre_mm) + gx * dx + gy * dy) / 1000;
  const double length = std::sqrt(1 + gx * gx + gy * gy);
  out.normal[0] = -gx / length;
  out.normal[1] = -gy / length;
  out.normal[2] = 1 / length;
  out.sd_m = node.sd_mm / 1000.0;
  out.weight = node.weight / 255.0;
  out.support = node.support / 256.0;
  return out;
}

SurfacePoint surface_at(const TileSource& map, double x_m, double y_m) {
  const double limit_m = static_cast<double>(kMaxHorizontal_mm) / 1000;
  if (!(std::abs(x_m) <= limit_m) || !(std::abs(y_m) <= limit_m)) return {};
  const auto x_mm = static_cast<std::int64_t>(std::floor(x_m * 1000 + 0.5));
  const auto y_mm = static_cast<std::int64_t>(std::floor(y_m * 1000 + 0.5));
  const Cell cell = map.layout().lattice.cell_at(x_mm, y_mm);
  const auto tile = map.load(map.layout().grid.tile_of(cell));
  if (!tile || !tile->box.contains(cell)) return {};
  return surface_in(*tile, x_mm, y_mm);
}

}  // namespace btms
