// The passes between points and finished tiles. Each is a function (interior + halo of a tile) -> interior, run on
// every tile this rank owns; it declares the halo it needs, and sees nothing else.
//
//   pass      equations  halo                       crosses a border as
//   model     2, 3, 5    none                       nothing: a node belongs to one tile
//   link      6          1 ring of candidates       copies of nodes
//   merge     -          1 ring of component ids    sorted pairs of component ids
//   complete  7-11       ceil(l/r - 1/6) rings      copies of terrain nodes
//   fit       12-13      1 ring of completed nodes  copies of nodes; shared corners come out of equal bits on both
//   sides
//   above     -          1 ring of sheets           copies of sheets, sorted pairs of component ids
//   layer     -          1 ring of corners, then    copies of corners and costs
//                        half a vehicle
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "engine/model/digest.h"
#include "engine/model/tile_store.h"
#include "engine/terrain/node.h"
#include "engine/terrain/parameters.h"
#include "engine/tiling/ordered_points.h"
#include "engine/tiling/point_bins.h"
#include "engine/tiling/progress.h"
#include "engine/tiling/tile_changes.h"
#include "engine/tiling/tile_field.h"
#include "engine/tiling/trajectory.h"

namespace btms {

using NodeFields = TileFields<Node>;
using FinishedTiles = Paged<TerrainTile>;  // one a tile of the table, empty where another rank's
class FinalTiles;                          // finished_tiles.h
class Records;                             // records.h

// What every pass works with.
struct PassContext {
  const Parameters& parameters;
  const TileTable& table;
  const Threads& threads;
  Ranks& ranks;
  Pager& pager;
  Progress& progress;
  const std::vector<TrajectoryPoint>& trajectory;
  const TileSet* only = nullptr;  // the tiles to work on; nullptr: all

  // The same, for some tiles only; they outlive it.
  PassContext on(const TileSet& tiles) const {
    return {parameters, table, threads, ranks, pager, progress, trajectory, &tiles};
  }
  bool owns(std::size_t tile) const { return table.tiles()[tile].owner == ranks.rank(); }
  // Runs body(tile index, worker) on every tile of this rank that is to be worked on, with the tile's elements of
  // `uses` in memory; stops when progress says so.
  void for_each_tile(const char* phase, const std::vector<Use>& uses,
                     const std::function<void(std::size_t, int)>& body) const;
};

inline constexpr std::int32_t kLinkHalo = 1;  // neighbours share a corner
inline constexpr std::int32_t kFitHalo = 1;   // a corner touches the squares around it
std::int32_t complete_halo(const Parameters& p);

// Points -> nodes, classes kEmpty, kNoPlane, kCandidate. Collective: a bin's nodes travel to the owners of its tiles.
void model_pass(const PassContext& context, PointBins&& bins, const BinGrid& grid, NodeFields& nodes);

struct ComponentCounts {
  std::uint64_t all = 0, kept = 0;
};
// Links candidates, merges components over borders, and turns candidates into kTerrain or kRejected. Collective; needs
// kLinkHalo rings of `nodes`, leaves halos stale.
ComponentCounts link_pass(const PassContext& context, NodeFields& nodes);

// Predicts nodes from the kTerrain nodes around them; needs complete_halo() rings, leaves halos stale.
void complete_pass(const PassContext& context, bool neighbours_by_lattice, NodeFields& nodes);

// Corners, final planes; needs kFitHalo rings.
FinishedTiles fit_pass(const PassContext& context, const NodeFields& nodes);

// What the points say about the space over the finished surface: roughness, clearance and further surfaces
// (terrain/above.h). Collective; coarse to fine only: maps of the fixed method have none of these.
void above_pass(const PassContext& context, const OrderedPoints& points, const Records& records, FinalTiles& tiles);

inline constexpr std::int32_t kStepHalo = 1;  // neighbours share a corner
// Step and cost on the finished surfaces, from their corners, roughness and clearance (0 and kNothingAbove where
// nothing is known). Collective. Needs kStepHalo rings of corners and Vehicle::rings() of costs, and fetches them.
void layer_pass(const PassContext& context, FinalTiles& finished);

struct CommitSummary {
  Digest digest;
  std::uint64_t tiles = 0, renewed = 0, observed = 0, predicted = 0, obstacle = 0, filled = 0, unknown = 0;
  std::uint64_t nodes() const { return observed + predicted + obstacle + filled + unknown; }
  CommitSummary& operator+=(const CommitSummary& o);
};
// Finished tiles that hold anything go into the sink; those that are as in the map before are kept as they are there.
// Sums over this rank's tiles.
CommitSummary commit_pass(const PassContext& context, FinalTiles&& finished, TileSink& sink);

}  // namespace btms
