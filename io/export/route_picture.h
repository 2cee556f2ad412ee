// Ways drawn on a relief.
#pragma once

#include <span>

#include "io/export/relief.h"

namespace btms {

inline constexpr Rgb kRouteColour{26, 90, 214}, kStartColour{20, 140, 70}, kGoalColour{200, 30, 60};

// A box of squares around places, for draw_relief(): with room on every side, and not too small to see where it is.
CellBox surroundings(std::span<const Place> places, const Lattice& lattice);

// A line with a light rim, `width` pixels wide; what lies beside the map is left out.
void draw_way(Relief& relief, std::span<const Place> way, Rgb colour, double width = 6);
// A disc with a light rim and a word beside it.
void draw_mark(Relief& relief, Place place, Rgb colour, std::string_view word);

}  // namespace btms
