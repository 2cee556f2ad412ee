// From the last round of the finest level to finished tiles.
#include <algorithm>
#include <cmath>

#include "engine/terrain/ground_spread.h"
#include "engine/tiling/level_passes.h"
#include "engine/tiling/level_points.h"

namespace btms {
namespace {

// One value a cell of the coarsest level (triangle 0; the others are unused). A bin is such a cell.
using SpreadFields = TileFields<GroundSpread>;
inline constexpr std::int32_t kSpreadHalo = 1;

Cell coarsest_cell(Cell finest, int levels) {
  return {static_cast<std::int32_t>(floor_div(finest.col, 1 << (levels - 1))),
          static_cast<std::int32_t>(floor_div(finest.row, 1 << (levels - 1)))};
}

// Scatter of the points below the surface, by coarsest cell, halos filled.
SpreadFields measure_spread(const PassContext& context, const TileTable& coarsest, const PointBins& bins,
                            const BinGrid& grid, const std::vector<LevelSurface>& surfaces) {
  const int levels = level_count(context.parameters);
  SpreadFields spread(surfaces.size());
  for (std::size_t i = 0; i < spread.size(); ++i)
    if (context.owns(i)) spread[i] = TileField<GroundSpread>(coarsest.tiles()[i].box, kSpreadHalo);
  for_each_node_with_points(context, "spread", bins, grid, [&](std::size_t i, NodeId n, const NodePoints& points) {
    if (surfaces[i].is_outside(n)) return;
    const PriorPlane plane = surfaces[i].plane_of(n);
    GroundSpread here;
    for (std::size_t k = 0; k < points.size; ++k)
      here.add(static_cast<std::int64_t>(round_half_up(plane.at(points.x_mm[k], points.y_mm[k]))) - points.z_mm[k]);
    *spread[i].cell(coarsest_cell(n.cell, levels)) += here;
  });
  exchange_halo(coarsest, spread, kSpreadHalo, context.threads, context.ranks);
  return spread;
}

// Standard deviation of the ground's points around a coarsest cell.
double spread_around(const TileField<GroundSpread>& spread, Cell c) {
  GroundSpread all;
  for (std::int32_t row = c.row - kSpreadHalo; row <= c.row + kSpreadHalo; ++row)
    for (std::int32_t col = c.col - kSpreadHalo; col <= c.col + kSpreadHalo; ++col) all += *spread.cell({col, row});
  return all.sd_mm();
}

class Finish {
 public:
  Finish(const LevelRules& rules, const LastRound& last, std::size_t tile)
      : rules_(rules),
        nodes_(last.nodes[tile]),
        completed_(last.completed[tile]),
        surface_(last.surfaces[tile]),
        tile_(rules.r_mm(), surface_.box) {}

  // spread_mm: of the ground's points around the node.
  void add(NodeId n, double spread_mm) {
    const LevelNode& own = nodes_.cell(n.cell)[n.triangle];
    NodeSurface& out = tile_.nodes[tile_.node_index(n)];
    out.count = own.count;
    if (surface_.is_outside(n)) return;
    const auto corners = surface_.corners_of(n);
    const PriorPlane plane = surface_.plane_of(n);
    const LevelParameters& q = rules_.p();
    out.weight = static_cast<std::uint8_t>((completed_.cell(n.cell)[n.triangle].weight * 255u + 32768u) >> 16);
    out.sd_mm =
        static_cast<std::uint16_t>((std::uint32_t{corners[0].sd_mm} + corners[1].sd_mm + corners[2].sd_mm + 1) / 3);
    out.terrain_mm = saturate_u16(q.label_spread * spread_mm +
                                  q.label_slope * 1000 * std::min(plane.slope(), q.label_slope_cap) +
                                  q.label_uncertainty * plane.sd_mm);
    if (own.has_plane()) {
      out.state = NodeState::kObserved;
    } else {
      const bool stands =
          own.count > 0 && own.mean_z_mm - plane.at(own.mean_x_mm, own.mean_y_mm) > q.near_m * 1000;
      out.state = stands ? NodeState::kObstacle : NodeState::kPredicted;
    }
    const auto rel = triangle_corners(n.triangle);
    tile_.centre_mm[tile_.cell_index(n.cell)] = corners[0].z_mm;
    for (int k = 1; k < 3; ++k)
      tile_.corner_mm[tile_.corner_index({n.cell.col + rel[k].x / 2, n.cell.row + rel[k].y / 2})] = corners[k].z_mm;
  }
  TerrainTile take() { return std::move(tile_); }

 private:
  const LevelRules& rules_;
  const TileField<LevelNode>& nodes_;
  const TileField<LevelNode>& completed_;
  const LevelSurface& surface_;
  TerrainTile tile_;
};

}  // namespace

std::vector<TerrainTile> finish_levels(const PassContext& context, const TileTable& coarsest, const PointBins& bins,
                                       const BinGrid& grid, const LevelRules& rules, const LastRound& last) {
  const SpreadFields spread = measure_spread(context, coarsest, bins, grid, last.surfaces);
  const int levels = level_count(context.parameters);
  std::vector<TerrainTile> tiles(last.surfaces.size());
  context.for_each_tile("finish", [&](std::size_t i, int) {
    Finish finish(rules, last, i);
    Cell at{INT32_MIN, INT32_MIN};
    double spread_mm = 0;
    for_each_node(last.surfaces[i].box, [&](NodeId n) {
      const Cell block = coarsest_cell(n.cell, levels);
      if (!(block == at)) spread_mm = spread_around(spread[i], at = block);
      finish.add(n, spread_mm);
    });
    tiles[i] = finish.take();
  });
  return tiles;
}

}  // namespace btms
