// Coordinate reference systems as PROJ's objects. For the files here that know PROJ.
#pragma once

#include <string>

#include "io/crs/proj_objects.h"

namespace btms {

// Of WKT or a code ("EPSG:25832+5783"), never of what would make PROJ read a file; null when it is none. A datum shift
// that WKT 1 carries along is left out.
ProjObject parse_crs(PJ_CONTEXT* context, const std::string& crs);

// Part 0 (horizontal) or 1 (vertical) of a compound system; a plain one is its own part 0.
ProjObject crs_part(PJ_CONTEXT* context, const PJ* crs, int index);

// Part 0 without a third axis. Of a geocentric system: null.
ProjObject plane_part(PJ_CONTEXT* context, const PJ* crs);

}  // namespace btms
