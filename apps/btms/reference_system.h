// The coordinate reference system of a map, from its inputs and --crs.
#pragma once

#include <string>
#include <vector>

#include "apps/btms/inputs.h"

namespace btms {

// The name in a WKT text, with its EPSG code where it ends in one; other text as it is.
std::string crs_title(const std::string& text);

// The reference system of a --crs option, normalised; empty stays empty. A plain number is an EPSG code. Throws
// Error(kUsage) when it is neither EPSG:n nor WKT, PROJ doesn't know it, or its unit is not the metre.
std::string metric_crs(const std::string& text);

// What the user says of reference systems.
struct CrsChoice {
  std::string taken_to_be;   // --crs: all coordinates are in it, whatever the files say
  std::string converted_to;  // --to-crs: the map's; files that name another one are converted
};

// The one reference system of the files, normalised; empty when none names one. Without a choice it is that of the
// first file that names one. Files that name another are opened anew, converted to it. Appends to `warnings`: what is
// converted, a file that says otherwise than --crs, or says nothing, and files so far apart that they cannot be in one
// system unless they say so. Throws Error(kBadInput) naming two files whose heights are above different surfaces,
// Error(kUsage) when PROJ knows no way from one system to the other.
std::string agree_on_crs(PointFiles& files, const CrsChoice& choice, std::vector<std::string>& warnings);

// Opens files that name another system than `crs` (empty: none do) anew, converted to it. Returns a sentence for each
// system that was.
std::vector<std::string> convert_to(PointFiles& files, const std::string& crs);

}  // namespace btms
