// Coordinate reference systems through PROJ. Every call opens its own PROJ context, so all are thread-safe; "EPSG:n"
// opens PROJ's database (13 ms), WKT doesn't need it (below 1 ms).
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace btms {

// What a CF grid mapping says.
struct Crs {
  std::string wkt;                                         // WKT2:2019 in one line, with its ID where it has one
  std::string grid_mapping_name;                           // CF name, or empty where CF has none
  std::vector<std::pair<std::string, double>> parameters;  // CF attribute names
  bool is_geographic = false;                              // coordinates are angles
  double linear_unit_m = 1;                                // metres per unit of x and y; 1 when geographic
  double vertical_unit_m = 0;                              // metres per unit of stated heights; 0: none are stated
  int epsg = 0;                                            // code of the whole or of its horizontal part; 0: none
  int horizontal_epsg = 0, vertical_epsg = 0;              // codes of the parts; 0: none
  std::string esri_wkt;                                    // of the horizontal part in Esri's form of WKT 1, or empty
  std::string vertical_name;                               // of a compound system's second part, or empty
  std::string height_standard_name;                        // CF name of heights, or empty when unknown
};

// From WKT 1 or 2, or "EPSG:n". Throws Error(kUsage) for a name PROJ doesn't know, Error(kBadInput) for bad WKT.
Crs describe_crs(const std::string& wkt_or_epsg);

// Crs::wkt of it; the empty text stays empty.
std::string normalise_crs(const std::string& wkt_or_epsg);

}  // namespace btms
