// What a coordinate reference system says about units and heights.
#pragma once

#include <string>

namespace btms {

struct CrsUnits {
  bool understood = false;  // false: the text is not one PROJ can read, nothing below is meant
  bool in_degrees = false;  // geographic: latitude and longitude
  bool geocentric = false;  // x, y, z from the centre of the Earth: no plane, and up is not z
  double horizontal_m = 1;  // metres per unit
  double vertical_m = 0;    // metres per unit of a stated vertical system, 0 when none is stated
};

// `crs` is WKT of any kind or "EPSG:n". Thread-safe, like crs_in_metres(); both remember the last texts, since a
// survey's files repeat theirs.
CrsUnits crs_units(const std::string& crs);

// Whether both mean the same horizontal system, a vertical part and the order of axes aside. True when one is unclear.
bool same_horizontal_crs(const std::string& a, const std::string& b);

// What heights are above, as a name: "NAVD88 height", "ellipsoid", or empty when nothing is said.
std::string vertical_system(const std::string& crs);

// The same projection, and the same heights, with metres as their units, as WKT, for coordinates that were converted;
// empty when PROJ cannot.
std::string crs_in_metres(const std::string& crs);

// The horizontal system of `of`, with the heights of `heights` where that says what they are.
std::string with_heights_of(const std::string& of, const std::string& heights);

}  // namespace btms
