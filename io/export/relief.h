// A picture of a finished map: shaded relief, obstacles and predicted ground in colour, with a legend and a scale bar.
#pragma once

#include <cstdint>
#include <filesystem>

#include "engine/model/tile_store.h"

namespace btms {

// Writes an RGB PNG, north up, at most `max_pixels` wide or high; the legend is left out where it would not fit. Throws
// Error(kFailed).
void write_relief(const TileSource& map, const std::filesystem::path& png, std::uint32_t max_pixels = 1600);

}  // namespace btms
