#include "io/export/terrarium.h"

#include <algorithm>
#include <cmath>

#include "io/export/png.h"

namespace btms {
namespace {

// Each NaN becomes the nearest number before or after it. False where there is none.
bool fill(std::span<double> row) {
  const auto known = [](double v) { return !std::isnan(v); };
  auto last = std::find_if(row.begin(), row.end(), known);
  if (last == row.end()) return false;
  std::fill(row.begin(), last, *last);
  while (last != row.end()) {
    const auto gap = std::find_if_not(last, row.end(), known);
    const auto next = std::find_if(gap, row.end(), known);
    const auto middle = next == row.end() ? row.end() : gap + (next - gap) / 2;
    if (gap != last) std::fill(gap, middle, *(gap - 1));
    if (next != row.end()) std::fill(middle, next, *next);
    last = next;
  }
  return true;
}

Rgb colour_of(double height_m) {
  const auto steps = static_cast<std::uint32_t>(std::clamp(std::round((height_m + 32768) * 256), 0.0, 16777215.0));
  return {static_cast<std::uint8_t>(steps >> 16), static_cast<std::uint8_t>(steps >> 8 & 255),
          static_cast<std::uint8_t>(steps & 255)};
}

}  // namespace

std::vector<std::uint8_t> terrarium_png(std::uint32_t width, std::uint32_t height, std::vector<double> heights_m) {
  const auto row = [&](std::uint32_t y) { return std::span(heights_m).subspan(std::size_t{y} * width, width); };
  std::vector<std::uint32_t> filled;
  for (std::uint32_t y = 0; y < height; ++y)
    if (fill(row(y))) filled.push_back(y);
  if (filled.empty()) return {};
  for (std::uint32_t y = 0; y < height; ++y) {
    const auto nearest = *std::min_element(filled.begin(), filled.end(), [&](std::uint32_t a, std::uint32_t b) {
      return (a > y ? a - y : y - a) < (b > y ? b - y : y - b);
    });
    if (nearest != y) std::copy_n(row(nearest).begin(), width, row(y).begin());
  }
  std::vector<Rgb> pixels;
  pixels.reserve(heights_m.size());
  for (const double h : heights_m) pixels.push_back(colour_of(h));
  return png_of(width, height, pixels);
}

}  // namespace btms
