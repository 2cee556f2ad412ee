// A picture of a finished map: shaded relief, coloured by state or by a layer, with a legend and a scale bar.
#pragma once

#include <cstdint>
#include <filesystem>

#include "engine/model/tile_store.h"
#include "engine/query/place.h"
#include "io/export/layer_colours.h"
#include "io/export/picture.h"

namespace btms {

inline constexpr std::uint32_t kReliefPixels = 1600;

// Writes an RGB PNG, north up, at most `max_pixels` wide or high; the legend is left out where it would not fit. Throws
// Error(kFailed).
void write_relief(const TileSource& map, const std::filesystem::path& png, std::uint32_t max_pixels = kReliefPixels,
                  const PictureLayer& layer = picture_layers()[0]);

// The same in memory, for what is to be drawn on it.
struct Relief {
  Picture picture;
  double pixel_m = 1;            // edge of a pixel
  double left_m = 0, top_m = 0;  // where the picture's top left corner lies on the map
  int height = 0;                // of the map on it; the legend is below

  // In pixels, from the top left corner.
  Place on_picture(Place p) const { return {(p.x_m - left_m) / pixel_m, (top_m - p.y_m) / pixel_m}; }
};
// Of what the map holds in the box.
Relief draw_relief(const TileSource& map, const CellBox& box, std::uint32_t max_pixels = kReliefPixels,
                   const PictureLayer& layer = picture_layers()[0]);

}  // namespace btms
