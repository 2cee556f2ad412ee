// Points so few, and so far from all others, that they are a mistake of the survey and not a place in it: one wrong
// coordinate would give a map of a city the extent of a continent.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/tiling/point_bins.h"

namespace btms {

struct Strays {
  std::vector<BinId> bins;  // ascending
  std::uint64_t points = 0;
};

// Squares of 10 km that hold points and touch each other belong together, also across a corner. A group of them with
// fewer than 1000 points, and less than a thousandth of those of the largest group, is astray. A bin may be listed more
// than once, in any order: the answer depends on the points alone, not on how they are split among files and ranks.
Strays find_strays(std::span<const OccupiedBin> occupied, const BinGrid& grid);

}  // namespace btms
