// A picture of a finished map: shaded relief, coloured by state or by a layer, with a legend and a scale bar.
#pragma once

#include <cstdint>
#include <filesystem>

#include "engine/model/tile_store.h"
#include "io/export/layer_colours.h"

namespace btms {

inline constexpr std::uint32_t kReliefPixels = 1600;

// Writes an RGB PNG, north up, at most `max_pixels` wide or high; the legend is left out where it would not fit. Throws
// Error(kFailed).
void write_relief(const TileSource& map, const std::filesystem::path& png, std::uint32_t max_pixels = kReliefPixels,
                  const PictureLayer& layer = picture_layers()[0]);

}  // namespace btms
