// The coarse-to-fine build: the same loop as passes.h, level by level.
#pragma once

#include "engine/terrain/level_fit.h"
#include "engine/terrain/span.h"
#include "engine/tiling/level_nodes.h"
#include "engine/tiling/level_region.h"
#include "engine/tiling/level_scatter.h"
#include "engine/tiling/level_surface.h"
#include "engine/tiling/ordered_points.h"
#include "engine/tiling/passes.h"

namespace btms {

struct Judgement {
  ComponentCounts components;
  Changes changes;     // cells whose nodes, or the verdict on them, are not what the records say
  Changes overturned;  // those of them with another verdict than before
  bool in_halos;       // the completion halos have the verdicts, too
};
// Links the nodes of a level, counts rims, and rejects components that are not terrain (kRejected). `fitted`: the cells
// whose nodes have changed since the build that the records are of; tiles far from them contribute what is recorded.
// Collective; leaves halos stale, but for in_halos.
Judgement judge_level(const PassContext& context, const LevelRegions& regions, const LevelRules& rules,
                      const Records& records, int round, const Changes& fitted, LevelNodes& nodes);

// What lies under bridge decks, per tile and square of its box; empty where another rank's.
using SpanGrounds = Paged<std::vector<SpanGround>>;
// Finds bridge decks among the accepted nodes of these tiles and makes them kSpan, with everything under and over them.
// Collective; needs the interiors of all tiles within SpanRules::halo() rings, leaves halos stale.
SpanGrounds span_pass(const PassContext& context, const LevelRules& rules, const TileSet& tiles,
                      TileFields<LevelNode>& nodes);

// What the last round leaves: fitted nodes, the same completed, and the surface over each tile.
struct LastRound {
  const TileFields<LevelNode>& nodes;
  const TileFields<LevelNode>& completed;
  const Surfaces& surfaces;
  std::vector<ScatterFields>& misfits;  // of the levels after the first against the one before; it fetches their halos
};

// Finished tiles of those that are wanted: the surface, what the nodes know, and how far above it points are terrain.
// `context` is of the finest level. Collective.
FinishedTiles finish_levels(const PassContext& context, const TileTable& coarsest, const OrderedPoints& points,
                            const LevelRules& rules, const LastRound& last, const Measuring& ground,
                            const TileSet& wanted);

// Rounds of a level, 0 being the coarsest.
int rounds_of(const Parameters& p, int level);

// The map ends this many cells of the coarsest level beyond the last point.
inline constexpr std::int32_t kDomainRings = 1;

struct LevelInputs {
  const Parameters& parameters;
  const TileTable& coarsest;  // of the coarsest level
  const OrderedPoints& points;
  const std::vector<TrajectoryPoint>& trajectory;
  bool labels_only;  // what labels at the points read, at least; the rest may be left out
  bool by_lattice;   // how neighbours are found
  Records& records;
};

struct Levels {
  TileTable table;             // of the finest level
  FinishedTiles tiles;         // one per tile of the table, empty where another rank's
  ComponentCounts components;  // of the finest level's last round
  TileSet finished;            // the tiles made; of the others all is as in the build before
  TileSet worked_on;           // the tiles in which anything was worked out anew
  Changes bound;               // how far changes could have reached
};

// All levels from the points to finished tiles. Calls level_done(level) after each. Collective. Throws
// Error(kVerification) when what a build before has left is damaged.
Levels build_levels(const LevelInputs& in, const Threads& threads, Ranks& ranks, Pager& pager, Progress& progress,
                    const std::function<void(int)>& level_done);

}  // namespace btms
