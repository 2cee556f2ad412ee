// A map's folder as something to ask.
#pragma once

#include <filesystem>
#include <memory>

#include "engine/query/terrain.h"
#include "io/store/map_store.h"

namespace btms {

// One revision; both parts are thread-safe.
struct OpenedMap {
  std::shared_ptr<const MapReader> reader;
  Terrain terrain;
};

// Throws as MapReader::open().
OpenedMap open_terrain(const std::filesystem::path& folder, const TerrainOptions& options = {},
                       Trust trust = Trust::kTrusted);

}  // namespace btms
