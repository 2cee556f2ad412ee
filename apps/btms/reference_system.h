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

// The one reference system of the files, normalised; empty when none names one. `wanted`, when not empty, wins.
// Appends to `warnings`: a file that says otherwise than `wanted` or says nothing, and files so far apart that they
// cannot be in one system unless they say so. Throws Error(kBadInput) naming two files that differ.
std::string agreed_crs(const PointFiles& files, const std::string& wanted, std::vector<std::string>& warnings);

}  // namespace btms
