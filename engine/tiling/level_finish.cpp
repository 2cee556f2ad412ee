// From the last round of the finest level to finished tiles.
#include "engine/terrain/level_accuracy.h"
#include "engine/tiling/level_passes.h"
#include "engine/tiling/level_points.h"
#include "engine/tiling/level_scatter.h"

namespace btms {
namespace {

// What holds over a cell of the coarsest level.
struct Surroundings {
  double ground_mm = 0;             // scatter of the ground's points
  std::vector<double> coarser_mm2;  // variance of a height that is this many levels coarser
};

Surroundings surroundings(const ScatterFields& ground, const std::vector<ScatterFields>& misfits, std::size_t tile,
                          Cell c) {
  Surroundings s{around(ground[tile], c).rms_mm(), {0}};
  for (auto finer = misfits.rbegin(); finer != misfits.rend(); ++finer)
    s.coarser_mm2.push_back(s.coarser_mm2.back() + around((*finer)[tile], c).mean_square_mm2());
  return s;
}

class Finish {
 public:
  Finish(const LevelRules& rules, const LastRound& last, std::size_t tile)
      : rules_(rules),
        nodes_(last.nodes[tile]),
        completed_(last.completed[tile]),
        surface_(last.surfaces[tile]),
        tile_(rules.r_mm(), surface_.box) {}

  void add(NodeId n, const Surroundings& around) {
    const LevelNode& own = nodes_.cell(n.cell)[n.triangle];
    NodeSurface& out = tile_.nodes[tile_.node_index(n)];
    out.count = own.count;
    if (surface_.is_outside(n)) return;
    const auto corners = surface_.corners_of(n);
    const PriorPlane plane = surface_.plane_of(n);
    const double disagreement_mm =
        (static_cast<double>(corners[0].disagreement_mm) + corners[1].disagreement_mm + corners[2].disagreement_mm) / 3;
    out.source_level = plane.source;
    out.weight = static_cast<std::uint8_t>((completed_.cell(n.cell)[n.triangle].weight * 255u + 32768u) >> 16);
    out.terrain_mm = saturate_u16(terrain_height_mm(plane, disagreement_mm, around.ground_mm, rules_.p()));
    if (own.has_plane()) {
      out.state = NodeState::kObserved;
      out.sd_mm = saturate_u16(observed_sd_mm(disagreement_mm, around.ground_mm, rules_.p()));
    } else {
      out.state = inferred_state(own, plane);
      out.sd_mm = saturate_u16(inferred_sd_mm(plane, around.coarser_mm2[plane.source], around.ground_mm, rules_.p()));
    }
    const auto rel = triangle_corners(n.triangle);
    tile_.centre_mm[tile_.cell_index(n.cell)] = corners[0].z_mm;
    for (int k = 1; k < 3; ++k)
      tile_.corner_mm[tile_.corner_index({n.cell.col + rel[k].x / 2, n.cell.row + rel[k].y / 2})] = corners[k].z_mm;
  }
  TerrainTile take() { return std::move(tile_); }

 private:
  NodeState inferred_state(const LevelNode& own, const PriorPlane& plane) const {
    const double stands_mm = own.mean_z_mm - plane.at(own.mean_x_mm, own.mean_y_mm);
    if (own.count > 0 && stands_mm > rules_.p().near_m * 1000) return NodeState::kObstacle;
    const double source_m = rules_.r_m() * (1 << plane.source);
    return plane.source > 0 && source_m >= rules_.p().filled_m ? NodeState::kFilled : NodeState::kPredicted;
  }

  const LevelRules& rules_;
  const TileField<LevelNode>& nodes_;
  const TileField<LevelNode>& completed_;
  const LevelSurface& surface_;
  TerrainTile tile_;
};

}  // namespace

FinishedTiles finish_levels(const PassContext& context, const TileTable& coarsest, const OrderedPoints& points,
                            const LevelRules& rules, const LastRound& last, const Measuring& measuring,
                            const TileSet& wanted) {
  const int refinements = level_count(context.parameters) - 1;
  ScatterFields ground = measure_ground(context, coarsest, refinements, points, last.surfaces, measuring).fields;
  std::vector<ScatterFields*> scatters{&ground};
  for (ScatterFields& misfit : last.misfits) scatters.push_back(&misfit);
  exchange_halos<GroundScatter>(coarsest, scatters, kScatterHalo, context.threads, context.ranks);
  FinishedTiles tiles(context.pager, last.surfaces.size());
  std::vector<Use> uses{reads(last.nodes), reads(last.completed), reads(last.surfaces), reads(ground), writes(tiles)};
  for (const ScatterFields& misfit : last.misfits) uses.push_back(reads(misfit));
  context.on(wanted).for_each_tile("finish", uses, [&](std::size_t i, int) {
    Finish finish(rules, last, i);
    for_each_cell(coarsest.tiles()[i].box, [&](Cell c) {
      const Surroundings s = surroundings(ground, last.misfits, i, c);
      const std::int32_t k = 1 << refinements;
      const CellBox box{c.col * k, c.row * k, (c.col + 1) * k, (c.row + 1) * k};
      for_each_node(box.intersect(last.surfaces[i].box), [&](NodeId n) { finish.add(n, s); });
    });
    tiles[i] = finish.take();
  });
  return tiles;
}

}  // namespace btms
