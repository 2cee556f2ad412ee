// What a GeoTIFF says of its reference system: the GeoKeys of OGC 19-008r4.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace btms {

struct GeoKeys {
  std::vector<std::uint16_t> directory;  // tag 34735; empty without a reference system
  std::string text;                      // tag 34737, or empty
  double unit_m = 1;                     // of x and y
};

// Throws what describe_crs() throws. `crs_wkt` may be empty.
GeoKeys geo_keys(const std::string& crs_wkt);

}  // namespace btms
