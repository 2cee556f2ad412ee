// The main job: points in, finished tiles out.
//
// Passes (docs/architecture.md): partition, model, link, merge, complete, fit, layer, commit. Each sees one tile's
// interior and copies of its halo; halos are exchanged between passes. The result has the same bits for any tile grid,
// executor, thread count, rank count, and order or splitting of the inputs.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/model/digest.h"
#include "engine/model/tile_store.h"
#include "engine/terrain/parameters.h"
#include "engine/tiling/executor.h"
#include "engine/tiling/pager.h"
#include "engine/tiling/point_source.h"
#include "engine/tiling/progress.h"
#include "engine/tiling/round_memory.h"
#include "engine/tiling/trajectory.h"

namespace btms {

struct BuildOptions {
  Parameters parameters;
  // Tile edge in cells of the coarsest level, so that any edge nests; 0 = the whole map is one tile (see TileTable).
  // Default: 128 cells of the finest level.
  std::optional<std::int32_t> tile_cells;
  bool layers = true;  // also what only maps need: roughness, clearance, further surfaces, step, cost
  // Who only labels the points the map is made of may have less of it: coarse to fine and in one tile, the surface
  // reaches no further than their nodes. Labels there are the same.
  bool labels_only = false;
  std::vector<TrajectoryPoint> trajectory;  // of the sensor, may be empty: see trajectory.h
  bool neighbours_by_lattice = false;       // scan the lattice instead of querying nanoflann; same bits, for tests
  std::uint64_t memory_bytes = kUnlimited_bytes;  // of the whole process; what doesn't fit is parked on disk
  std::filesystem::path spill_folder = ".";       // where it is parked
  // Coarse to fine only: what builds of this map remember, and, where it follows a finished build, that one's tiles.
  // The result is that of a build without either.
  RoundMemory* memory = nullptr;
  const TileSource* before = nullptr;
  // Halos included; larger maps are refused before anything is allocated.
  std::uint64_t max_nodes = std::uint64_t{1} << 28;
};

// Edge of a tile in cells of the coarsest level: what `tile_cells` says or means.
std::int32_t tile_cells(const BuildOptions& options);

struct PhaseTime {
  std::string phase;
  double seconds;
  Traffic traffic;  // of all ranks
};

struct BuildSummary {
  MapLayout layout;
  Digest digest;
  std::uint64_t points = 0;          // points that took part
  std::uint64_t not_finite = 0;      // dropped
  std::uint64_t out_of_range = 0;    // dropped
  std::uint64_t strays = 0;          // dropped: see strays.h
  std::uint64_t outside_box = 0;     // kept, although outside the box that their file declares
  std::array<double, 4> extent_m{};  // west, south, east, north of the squares that hold points
  std::uint64_t tiles = 0;
  std::uint64_t tiles_renewed = 0;     // not as in the map before
  std::uint64_t tiles_recomputed = 0;  // worked on at all
  std::uint64_t tiles_in_reach = 0;    // of the changes, by the halos of all rounds, and of verdicts that have changed
  std::uint64_t nodes = 0;             // nodes with points, or with a surface
  std::uint64_t observed = 0, predicted = 0, obstacle = 0, filled = 0, unknown = 0;
  std::uint64_t components = 0, components_kept = 0;
  std::uint64_t spilled_bytes = 0;  // written to the spill folder, in all
  std::vector<PhaseTime> phases;
};

// Makes the sink that receives this rank's tiles, once the layout is known. Called once per rank.
using SinkFactory = std::function<TileSink&(const MapLayout&)>;

// Builds the model of all sources together. Collective over `ranks`: every rank passes the same sources and options,
// and gets the same summary. Throws Error(kBadInput) when no point is left, Error(kUsage) above max_nodes (naming where
// the points furthest out are), Error(kFailed) when the spill folder lacks the room that the
// memory limit makes necessary (before the points are read, as far as that is known then), Error(kCancelled) when
// progress says stop, and whatever a source or the sink throws.
BuildSummary build_map(std::span<const PointSource* const> sources, const BuildOptions& options, const Threads& threads,
                       Ranks& ranks, const SinkFactory& sink, Progress& progress);

}  // namespace btms
