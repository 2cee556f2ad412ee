// The steps of a round on the tiles that are worked on: fit, class, domain, completion, corners.
#pragma once

#include "engine/tiling/level_passes.h"

namespace btms {

using LevelFields = TileFields<LevelNode>;

// Where a round takes its prior from.
struct PriorSource {
  const Surfaces* surfaces = nullptr;  // nullptr: first level
  bool coarser = false;                // a level coarser than the nodes
  const SpanGrounds* spans = nullptr;  // what lies under bridges, where they have been looked for

  // Of the nodes of a square; of those outside they mean nothing.
  SquarePriors of(std::size_t tile, Cell c) const {
    if (!surfaces) return {};
    const LevelSurface& s = (*surfaces)[tile];
    return coarser ? s.planes_for_child(c) : s.planes_of(c);
  }
  // Under a bridge, in the square at this index of the tile's box.
  PriorPlane under(std::size_t tile, std::size_t square) const {
    const SpanGround& ground = (*spans)[tile][square];
    return {static_cast<double>(ground.z_mm), 0, 0, static_cast<double>(ground.sd_mm)};
  }
  // What a pass needs to ask for priors.
  Use use() const { return surfaces ? reads(*surfaces) : Use{}; }
  bool outside(std::size_t tile, NodeId n) const {
    return surfaces && (*surfaces)[tile].is_outside(coarser ? parent(n) : n);
  }
};

// Nodes of one level and their classes, from the points: all of them on the last level, the lowest of each finest node
// before. Squares without points stay as they are. `ground`: its scatter per cell of the coarsest level, where the fit
// follows that.
void fit_level(const PassContext& context, const OrderedPoints& points, int level, const LevelRules& rules,
               const PriorSource& prior, const ScatterFields* ground, LevelFields& nodes);

// The classes of nodes that have been fitted before.
void classify_level(const PassContext& context, const LevelRules& rules, const PriorSource& prior,
                    const LevelRegions& regions, LevelFields& nodes);

// First level: what lies further from any point than kDomainRings is not part of the map. Needs kDomainRings rings.
void bound_domain(const PassContext& context, LevelFields& nodes);

// Whether a node is completed from those around it, as far as completion_halo() rings.
bool wants_neighbours(const LevelNode& node, const LevelRules& rules);

// Step 7: fills `completed` (interior and one ring) from `nodes` and completion_halo() rings.
void complete_level(const PassContext& context, const LevelRules& rules, const PriorSource& prior,
                    const LevelRegions& regions, bool by_lattice, const LevelFields& nodes, LevelFields& completed);

// Step 8: corners, from kFitHalo rings of completed nodes.
LevelSurface fit_surface(const TileField<LevelNode>& nodes, const LevelRegion& region, const LevelRules& rules);

}  // namespace btms
