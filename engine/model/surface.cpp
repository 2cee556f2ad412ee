#include "engine/model/surface.h"

#include <cmath>
#include <memory>

#include "engine/lattice/plane.h"

namespace btms {
namespace {

constexpr double kUpperSlopeUnit = 8192;  // of UpperNode

// A place, and the tile that holds its cell.
struct Located {
  std::shared_ptr<const TerrainTile> tile;  // nullptr outside the map
  std::int64_t x_mm = 0, y_mm = 0;
};

Located locate(const TileSource& map, double x_m, double y_m) {
  const double limit_m = static_cast<double>(kMaxHorizontal_mm) / 1000;
  if (!(std::abs(x_m) <= limit_m) || !(std::abs(y_m) <= limit_m)) return {};
  const auto x_mm = static_cast<std::int64_t>(std::floor(x_m * 1000 + 0.5));
  const auto y_mm = static_cast<std::int64_t>(std::floor(y_m * 1000 + 0.5));
  const Cell cell = map.layout().lattice.cell_at(x_mm, y_mm);
  auto tile = map.load(map.layout().grid.tile_of(cell));
  if (!tile || !tile->box.contains(cell)) return {};
  return {std::move(tile), x_mm, y_mm};
}

// The node that holds the place. The centre of a square belongs to all four: to the first of them that has a surface.
NodeId node_with_surface(const TerrainTile& tile, std::int64_t x_mm, std::int64_t y_mm) {
  const Lattice lattice(tile.resolution_mm);
  NodeId id = lattice.node_at(x_mm, y_mm);
  const auto unknown = [&] { return tile.nodes[tile.node_index(id)].state == NodeState::kUnknown; };
  if (!unknown() || x_mm != lattice.centre_x_mm(id.cell) || y_mm != lattice.centre_y_mm(id.cell)) return id;
  while (id.triangle + 1 < kTriangles && unknown()) ++id.triangle;
  return id;
}

void set_normal(double gx, double gy, double (&normal)[3]) {
  const double length = std::sqrt(1 + gx * gx + gy * gy);
  normal[0] = -gx / length;
  normal[1] = -gy / length;
  normal[2] = 1 / length;
}

}  // namespace

SurfacePoint surface_in(const TerrainTile& tile, std::int64_t x_mm, std::int64_t y_mm) {
  const Lattice lattice(tile.resolution_mm);
  const NodeId id = node_with_surface(tile, x_mm, y_mm);
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
  set_normal(gx, gy, out.normal);
  out.sd_m = node.sd_mm / 1000.0;
  out.weight = node.weight / 255.0;
  out.support = node.support / 256.0;
  out.terrain_m = node.terrain_mm / 1000.0;
  out.roughness_m = node.roughness_mm / 1000.0;
  out.step_m = node.step_mm / 1000.0;
  if (node.clearance_mm != kNothingAbove) out.clearance_m = node.clearance_mm / 1000.0;
  if (node.cost != kNotTraversable) out.cost = node.cost / 254.0;
  out.source_resolution_m = std::ldexp(tile.resolution_mm / 1000.0, node.source_level);
  return out;
}

UpperPoint upper_point(const UpperNode& upper, std::int64_t dx_mm, std::int64_t dy_mm) {
  const double gx = upper.slope_x / kUpperSlopeUnit, gy = upper.slope_y / kUpperSlopeUnit;
  UpperPoint p;
  p.z_m = (upper.z_mm + gx * static_cast<double>(dx_mm) + gy * static_cast<double>(dy_mm)) / 1000;
  set_normal(gx, gy, p.normal);
  p.sd_m = upper.sd_mm / 1000.0;
  p.count = upper.count;
  p.kind = upper.kind;
  return p;
}

std::vector<UpperPoint> upper_surfaces_in(const TerrainTile& tile, std::int64_t x_mm, std::int64_t y_mm) {
  std::vector<UpperPoint> out;
  for_each_upper_in(tile, x_mm, y_mm, [&](std::size_t, const UpperPoint& p) { out.push_back(p); });
  return out;
}

SurfacePoint surface_at(const TileSource& map, double x_m, double y_m) {
  const Located at = locate(map, x_m, y_m);
  return at.tile ? surface_in(*at.tile, at.x_mm, at.y_mm) : SurfacePoint{};
}

std::vector<UpperPoint> upper_surfaces_at(const TileSource& map, double x_m, double y_m) {
  const Located at = locate(map, x_m, y_m);
  return at.tile ? upper_surfaces_in(*at.tile, at.x_mm, at.y_mm) : std::vector<UpperPoint>{};
}

}  // namespace btms
