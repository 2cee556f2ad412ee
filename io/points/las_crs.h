// Coordinate reference system and units of a LAS file, from its records.
#pragma once

#include "io/points/las_header.h"

namespace btms {

struct LasCrs {
  std::string text;         // WKT or "EPSG:n" that fits coordinates in metres, or empty
  double horizontal_m = 1;  // metres per file unit
  double vertical_m = 1;
  std::vector<std::string> warnings;
};

// Throws Error(kBadInput) for geographic and geocentric coordinates.
LasCrs read_las_crs(const InputFile& file, const LasHeader& header);

}  // namespace btms
