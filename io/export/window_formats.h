// A window as other programs take it. Raw tiles, for our own: raw_tile.h.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/export/raster.h"

namespace btms {

// NumPy: float32 of (layers, rows, cols), C order, north first.
std::vector<std::uint8_t> npy(const Window& window);
// A zip of one (rows, cols) array a layer, and `x`, `y`: float64 centres of columns and rows.
std::vector<std::uint8_t> npz(const Window& window);
// {"level", "rows", "cols", "cell_m", "min", "layers": {name: [[...]]}}; null where there is nothing.
std::string window_json(const Window& window);
// As the message grid_map_msgs/GridMap: every layer column-major from the north-west, that is first along -y, then -x
// of the map's axes as grid_map has them (row 0 the greatest x, column 0 the greatest y); centre, lengths, resolution.
std::string gridmap_json(const Window& window, const std::string& frame);
// A picture of the first layer in the colours of `btms build --picture`; heights as shaded relief.
std::vector<std::uint8_t> window_png(const Window& window);

}  // namespace btms
