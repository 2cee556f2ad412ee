#include "engine/tiling/level_scatter.h"

#include "engine/lattice/wide.h"
#include "engine/tiling/level_points.h"

namespace btms {
namespace {

constexpr std::int32_t kScatterHalo = 1;

ScatterFields scatter_fields(const PassContext& context, const TileTable& coarsest) {
  ScatterFields fields(coarsest.tiles().size());
  for (std::size_t i = 0; i < fields.size(); ++i)
    if (context.owns(i)) fields[i] = TileField<GroundScatter>(coarsest.tiles()[i].box, kScatterHalo);
  return fields;
}

// The points below the surface of their node.
BTMS_WIDE GroundScatter scatter_below(const NodePoints& points, const PriorPlane& plane) {
  GroundScatter out;
  for (std::size_t k = 0; k < points.size; ++k) {
    const double height_mm = round_half_up(plane.at(points.x_mm[k], points.y_mm[k]));
    // Neither is beyond 2^30: heights_mm.
    out.add_below(static_cast<std::int32_t>(height_mm) - points.z_mm[k]);
  }
  return out;
}

}  // namespace

ScatterFields measure_ground(const PassContext& context, const TileTable& coarsest, int refinements,
                             const PointBins& bins, const BinGrid& grid, const std::vector<LevelSurface>& surfaces) {
  ScatterFields fields = scatter_fields(context, coarsest);
  for_each_node_with_points(context, "spread", bins, grid, [&](std::size_t i, NodeId n, const NodePoints& points) {
    if (surfaces[i].is_outside(n)) return;
    *fields[i].cell(coarsest_cell(n.cell, refinements)) += scatter_below(points, surfaces[i].plane_of(n));
  });
  exchange_halo(coarsest, fields, kScatterHalo, context.threads, context.ranks);
  return fields;
}

ScatterFields measure_misfit(const PassContext& context, const TileTable& coarsest, int refinements,
                             const TileFields<LevelNode>& nodes) {
  ScatterFields fields = scatter_fields(context, coarsest);
  context.for_each_tile("misfit", [&](std::size_t i, int) {
    for_each_node(nodes[i].interior(), [&](NodeId n) {
      const LevelNode& node = nodes[i].cell(n.cell)[n.triangle];
      if (node.has_plane()) fields[i].cell(coarsest_cell(n.cell, refinements))->add(node.above_prior_mm);
    });
  });
  exchange_halo(coarsest, fields, kScatterHalo, context.threads, context.ranks);
  return fields;
}

GroundScatter around(const TileField<GroundScatter>& scatter, Cell c) {
  GroundScatter all;
  for (std::int32_t row = c.row - kScatterHalo; row <= c.row + kScatterHalo; ++row)
    for (std::int32_t col = c.col - kScatterHalo; col <= c.col + kScatterHalo; ++col) all += *scatter.cell({col, row});
  return all;
}

}  // namespace btms
