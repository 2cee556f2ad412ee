#include "engine/tiling/level_scatter.h"

#include "engine/lattice/wide.h"
#include "engine/tiling/level_points.h"

namespace btms {
namespace {

constexpr std::int32_t kScatterHalo = 1;

ScatterFields scatter_fields(const PassContext& context, const TileTable& coarsest) {
  ScatterFields fields(context.pager, coarsest.tiles().size());
  context.for_each_tile("misfit", {writes(fields)}, [&](std::size_t i, int) {
    fields[i] = TileField<GroundScatter>(coarsest.tiles()[i].box, kScatterHalo);
  });
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
                             const OrderedPoints& points, const Surfaces& surfaces) {
  ScatterFields fields = scatter_fields(context, coarsest);
  points.for_each_bin("spread", context.threads, context.progress,
                      [&](std::size_t i, BinId id, const OrderedPoints::Bin& bin, int) {
                        const InUse tile({reads(surfaces), writes(fields)}, i);
                        GroundScatter& here = *fields[i].cell({id.bx, id.by});
                        for_each_square(bin, cells_of(id, refinements), [&](Cell c, const SquarePoints& square) {
                          for (std::uint8_t t = 0; t < kTriangles; ++t)
                            if (square[t].size > 0 && !surfaces[i].is_outside({c, t}))
                              here += scatter_below(square[t], surfaces[i].plane_of({c, t}));
                        });
                      });
  exchange_halo(coarsest, fields, kScatterHalo, context.threads, context.ranks);
  return fields;
}

ScatterFields measure_misfit(const PassContext& context, const TileTable& coarsest, int refinements,
                             const TileFields<LevelNode>& nodes) {
  ScatterFields fields = scatter_fields(context, coarsest);
  context.for_each_tile("misfit", {reads(nodes), writes(fields)}, [&](std::size_t i, int) {
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
