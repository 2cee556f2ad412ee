#include "io/store/open_terrain.h"

namespace btms {

OpenedMap open_terrain(const std::filesystem::path& folder, const TerrainOptions& options, Trust trust) {
  const std::shared_ptr<const MapReader> reader = MapReader::open(folder, trust);
  return {reader, Terrain(reader, options)};
}

}  // namespace btms
