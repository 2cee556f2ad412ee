// The forms a window is answered in: one table for tiles, bundles, submaps and EDR cubes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/export/raster.h"

namespace btms {

struct MapRevision;

struct WindowFormat {
  const char* name;
  const char* type;
  // `id` is that of a served tile; windows of their own have {0, 0}. nullptr: stored bytes, not made of a window.
  std::vector<std::uint8_t> (*encode)(const Window& window, TileId id, const MapRevision& revision);
};

// Throws Problem("bad_parameter") naming those there are.
const WindowFormat& tile_format(const std::string& name);
const WindowFormat& submap_format(const std::string& name);

}  // namespace btms
