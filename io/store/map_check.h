// Whether a map on disk is all that its manifest says: what `btms verify` does.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "engine/tiling/executor.h"
#include "engine/tiling/progress.h"
#include "io/store/manifest.h"

namespace btms {

// One thing that is wrong.
struct MapProblem {
  std::string file;           // inside the map, "shards/x0_y0.r1.nc"
  std::vector<TileId> tiles;  // whose content is in doubt; none where it is not the terrain
  std::string what;
};

struct MapCheck {
  std::vector<MapProblem> problems;  // by shard, then seams, then map.nc
  std::set<std::size_t> damaged;     // shards, as counted in the manifest, that are not what it says
  bool has_view = true;              // map.nc is the view of this revision
  std::vector<std::string> strays;   // files that are not the map's; no problem
  std::uint64_t bytes = 0;           // read of shards
};

// Reads every shard, a few at a time: size and hash of the file, structure, axes and reference system, hash and digest
// of its values, that root layers follow from the model, that corner heights on the borders between shards are equal on
// both sides. Compares map.nc with the one this program would write. Throws Error(kCancelled) when progress says stop,
// Error(kFailed) when the system can't read a file. With kUntrusted as MapReader::open(). Collective over `ranks`: with
// the same manifest, each reads its share of the shards, and all get the same answer.
MapCheck check_map(const std::filesystem::path& folder, const Manifest& manifest, Trust trust, const Threads& threads,
                   Ranks& ranks, Progress& progress);

// "3,-1 4,-1"
std::string tiles_text(const std::vector<TileId>& tiles);

}  // namespace btms
