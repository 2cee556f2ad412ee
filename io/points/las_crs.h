// Coordinate reference system and units of a LAS file, from its records.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/points/las_header.h"

namespace btms {

struct LasCrs {
  enum class Kind : std::uint8_t { kPlane, kDegrees, kGeocentric };
  Kind kind = Kind::kPlane;
  std::string text;         // WKT or "EPSG:n" that fits coordinates in metres (or degrees), or empty
  double horizontal_m = 1;  // metres per file unit
  double vertical_m = 1;
  std::vector<std::string> warnings;
};

// Throws Error(kBadInput) for degrees and geocentric coordinates in a system that is not named.
LasCrs read_las_crs(const InputFile& file, const LasHeader& header);

}  // namespace btms
