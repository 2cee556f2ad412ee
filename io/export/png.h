// PNG in memory.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace btms {

struct Rgb {
  std::uint8_t r = 255, g = 255, b = 255;
  friend bool operator==(const Rgb&, const Rgb&) = default;
};

// Rows from the top. Throw Error(kFailed). Preconditions: width x height pixels, neither 0.
std::vector<std::uint8_t> png_of(std::uint32_t width, std::uint32_t height, std::span<const Rgb> pixels);
std::vector<std::uint8_t> png_of(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> grey);

}  // namespace btms
