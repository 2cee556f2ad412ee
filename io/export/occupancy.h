// A window as Nav2's map server has maps: an image and a text beside it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/export/raster.h"

namespace btms {

enum class OccupancyMode {
  kTrinary,  // 254 free, 0 occupied, 205 unknown
  kRaw,      // 0 free .. 100 occupied, 255 unknown
};
const char* occupancy_mode_name(OccupancyMode mode);  // "trinary", "raw"

struct Occupancy {
  OccupancyMode mode = OccupancyMode::kTrinary;
  std::size_t rows = 0, cols = 0;
  double min_x_m = 0, min_y_m = 0, cell_m = 0;
  std::vector<std::uint8_t> pixels;  // north first

  std::vector<std::uint8_t> pgm() const;
  std::vector<std::uint8_t> png() const;
  std::string yaml(const std::string& image) const;
};

// What the vehicle of the map can't cross is occupied, and what lies within inflation_m of it (centre to centre);
// squares without a surface are unknown. Preconditions: the window's layers are `cost` and `class`; inflation_m >= 0.
Occupancy occupancy_of(const Window& window, OccupancyMode mode, double inflation_m);

}  // namespace btms
