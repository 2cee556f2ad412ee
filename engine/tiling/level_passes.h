// The coarse-to-fine build: the same loop as passes.h, level by level.
#pragma once

#include "engine/terrain/level_fit.h"
#include "engine/terrain/span.h"
#include "engine/tiling/level_surface.h"
#include "engine/tiling/passes.h"

namespace btms {

// Links the nodes of a level, counts rims, and rejects components that are not terrain (kRejected). Collective; needs
// kLinkHalo rings of `nodes`, leaves halos stale.
ComponentCounts judge_level(const PassContext& context, const LevelRules& rules, TileFields<LevelNode>& nodes);

// What lies under bridge decks, per tile and square of its box; empty where another rank's.
using SpanGrounds = std::vector<std::vector<SpanGround>>;
// Finds bridge decks among the accepted nodes and makes them kSpan, with everything under and over them. Collective;
// needs no halo of `nodes`, leaves halos stale.
SpanGrounds span_pass(const PassContext& context, const LevelRules& rules, TileFields<LevelNode>& nodes);

struct Levels {
  TileTable table;                 // of the finest level
  std::vector<TerrainTile> tiles;  // one per tile of the table, empty where another rank's
  ComponentCounts components;      // of the finest level's last round
};

// The map ends this many cells of the coarsest level beyond the last point.
inline constexpr std::int32_t kDomainRings = 1;

// All levels from the binned points (bins of `grid`: one cell of the coarsest level) to finished tiles. `coarsest` is
// the table of the coarsest level. Calls level_done(level) after each. Collective.
Levels build_levels(const Parameters& parameters, const TileTable& coarsest, const PointBins& bins, const BinGrid& grid,
                    bool neighbours_by_lattice, const Threads& threads, Ranks& ranks, Progress& progress,
                    const std::function<void(int)>& level_done);

}  // namespace btms
