// The coarse-to-fine build: the same loop as passes.h, level by level.
#pragma once

#include "engine/terrain/level_fit.h"
#include "engine/terrain/span.h"
#include "engine/tiling/level_region.h"
#include "engine/tiling/level_scatter.h"
#include "engine/tiling/level_surface.h"
#include "engine/tiling/ordered_points.h"
#include "engine/tiling/passes.h"

namespace btms {

// Links the nodes of a level, counts rims, and rejects components that are not terrain (kRejected). Collective; needs
// kLinkHalo rings of `nodes`, leaves halos stale.
ComponentCounts judge_level(const PassContext& context, const LevelRegions& regions, const LevelRules& rules,
                            TileFields<LevelNode>& nodes);

// What lies under bridge decks, per tile and square of its box; empty where another rank's.
using SpanGrounds = Paged<std::vector<SpanGround>>;
// Finds bridge decks among the accepted nodes and makes them kSpan, with everything under and over them. Collective;
// needs no halo of `nodes`, leaves halos stale.
SpanGrounds span_pass(const PassContext& context, const LevelRules& rules, TileFields<LevelNode>& nodes);

struct Levels {
  TileTable table;             // of the finest level
  FinishedTiles tiles;         // one per tile of the table, empty where another rank's
  ComponentCounts components;  // of the finest level's last round
};

// What the last round leaves: fitted nodes, the same completed, and the surface over each tile.
struct LastRound {
  const TileFields<LevelNode>& nodes;
  const TileFields<LevelNode>& completed;
  const Surfaces& surfaces;
  const std::vector<ScatterFields>& misfits;  // of the levels after the first against the one before
};

// Finished tiles: the surface, what the nodes know, and how far above it points are terrain. `context` is of the
// finest level. Collective.
FinishedTiles finish_levels(const PassContext& context, const TileTable& coarsest, const OrderedPoints& points,
                            const LevelRules& rules, const LastRound& last);

// Rounds of a level, 0 being the coarsest.
int rounds_of(const Parameters& p, int level);

// The map ends this many cells of the coarsest level beyond the last point.
inline constexpr std::int32_t kDomainRings = 1;

// All levels from the points to finished tiles. `coarsest` is the table of the coarsest level. Calls level_done(level)
// after each. `labels_only`: what labels at the points read, at least; the rest may be left out. Collective.
Levels build_levels(const Parameters& parameters, const TileTable& coarsest, const OrderedPoints& points,
                    const std::vector<TrajectoryPoint>& trajectory, bool labels_only, bool neighbours_by_lattice,
                    const Threads& threads, Ranks& ranks, Pager& pager, Progress& progress,
                    const std::function<void(int)>& level_done);

}  // namespace btms
