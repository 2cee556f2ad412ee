// What `btms verify --repair` takes from a map's inputs.
#pragma once

#include <string>
#include <vector>

#include "apps/btms/memory_option.h"
#include "engine/tiling/executor.h"
#include "engine/tiling/progress.h"
#include "io/points/point_file.h"
#include "io/store/map_repair.h"

namespace btms {

struct RebuildInputs {
  std::vector<std::string> points;  // as given to build
  PointFileOptions options;
  std::string trajectory;
};

// Builds the map of `manifest` again, of which only the missing shards are kept, and puts those back that come out as
// they were. Throws Error(kBadInput) when the inputs are not the ones the manifest names, and what build_map() throws.
void rebuild_missing(const std::string& map, const Manifest& manifest, const RebuildInputs& inputs,
                     const MemoryOption& memory, const Threads& threads, Progress& progress, MapRepair& repair);

}  // namespace btms
