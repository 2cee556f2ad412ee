// Heights as map libraries of the web take them: a PNG whose colours are numbers, height = 256 R + G + B / 256 - 32768.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace btms {

// Steps of 1/256 m. There is no colour for "nothing": what is NaN takes the height of the nearest known pixel of its
// row, or of the nearest row, for display only. Empty when all is NaN. Precondition: width x height heights from the
// top.
std::vector<std::uint8_t> terrarium_png(std::uint32_t width, std::uint32_t height, std::vector<double> heights_m);

}  // namespace btms
