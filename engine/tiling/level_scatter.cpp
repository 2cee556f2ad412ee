#include "engine/tiling/level_scatter.h"

#include "engine/lattice/wide.h"
#include "engine/tiling/level_points.h"

namespace btms {
namespace {

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

// What hasn't been measured is as recorded.
Measured settle(const PassContext& context, const TileTable& coarsest, ScatterFields&& fields,
                const Measuring& measuring) {
  const auto& tiles = coarsest.tiles();
  Measured out{std::move(fields), Changes(tiles.size())};
  const Records& records = measuring.records;
  if (!records.keep() && count(measuring.anew) == tiles.size()) {
    out.changes = Changes::everywhere(coarsest);
    return out;
  }
  context.for_each_tile("compare", {writes(out.fields)}, [&](std::size_t i, int) {
    const Tile& tile = tiles[i];
    TileField<GroundScatter>& field = out.fields[i];
    std::vector<GroundScatter> kept;
    if (!measuring.anew[i]) {
      records.recall(measuring.number, tile.id, tile.box, kept);
      records.require(kept.size() == static_cast<std::size_t>(tile.box.cells()), tile.id);
      std::size_t k = 0;
      for_each_cell(tile.box, [&](Cell c) { *field.cell(c) = kept[k++]; });
      return;
    }
    if (!records.keep()) return;
    const std::vector<GroundScatter> now = cells_of(field);
    const bool known =
        records.follow() && records.load(measuring.number, tile.id, tile.box, kept) && kept.size() == now.size();
    std::size_t k = 0;
    for_each_cell(tile.box, [&](Cell c) {
      if (!known || kept[k].squares_mm2 != now[k].squares_mm2 || kept[k].count != now[k].count)
        out.changes.boxes[i] = out.changes.boxes[i].hull({c.col, c.row, c.col + 1, c.row + 1});
      ++k;
    });
    if (!out.changes.boxes[i].empty()) records.save(measuring.number, tile.id, tile.box, now);
  });
  if (count(measuring.anew) > 0) records.finish(measuring.number);
  if (records.keep())
    out.changes.share(context.ranks);
  else
    out.changes = Changes::everywhere(coarsest);
  return out;
}

}  // namespace

Measured measure_ground(const PassContext& context, const TileTable& coarsest, int refinements,
                        const OrderedPoints& points, const Surfaces& surfaces, const Measuring& measuring) {
  ScatterFields fields = scatter_fields(context, coarsest);
  points.for_each_bin("spread", context.threads, context.progress, &measuring.anew,
                      [&](std::size_t i, BinId id, const OrderedPoints::Bin& bin, int) {
                        const InUse tile({reads(surfaces), writes(fields)}, i);
                        GroundScatter& here = *fields[i].cell({id.bx, id.by});
                        for_each_square(bin, cells_of(id, refinements), [&](Cell c, const SquarePoints& square) {
                          for (std::uint8_t t = 0; t < kTriangles; ++t)
                            if (square[t].size > 0 && !surfaces[i].is_outside({c, t}))
                              here += scatter_below(square[t], surfaces[i].plane_of({c, t}));
                        });
                      });
  return settle(context, coarsest, std::move(fields), measuring);
}

Measured measure_misfit(const PassContext& context, const TileTable& coarsest, int refinements,
                        const TileFields<LevelNode>& nodes, const Measuring& measuring) {
  ScatterFields fields = scatter_fields(context, coarsest);
  context.on(measuring.anew).for_each_tile("misfit", {reads(nodes), writes(fields)}, [&](std::size_t i, int) {
    for_each_node(nodes[i].interior(), [&](NodeId n) {
      const LevelNode& node = nodes[i].cell(n.cell)[n.triangle];
      if (node.has_plane()) fields[i].cell(coarsest_cell(n.cell, refinements))->add(node.above_prior_mm);
    });
  });
  return settle(context, coarsest, std::move(fields), measuring);
}

std::vector<GroundScatter> cells_of(const TileField<GroundScatter>& scatter) {
  std::vector<GroundScatter> out;
  for_each_cell(scatter.interior(), [&](Cell c) { out.push_back(*scatter.cell(c)); });
  return out;
}

GroundScatter around(const TileField<GroundScatter>& scatter, Cell c) {
  GroundScatter all;
  for (std::int32_t row = c.row - kScatterHalo; row <= c.row + kScatterHalo; ++row)
    for (std::int32_t col = c.col - kScatterHalo; col <= c.col + kScatterHalo; ++col) all += *scatter.cell({col, row});
  return all;
}

}  // namespace btms
