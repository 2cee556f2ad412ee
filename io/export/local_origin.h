// Coordinates as float32 from a place near by: far from 0, as UTM coordinates are, a float32 has steps of half a metre.
#pragma once

#include <cstdint>
#include <string>

#include "engine/lattice/coordinates.h"

namespace btms {

struct LocalOrigin {
  std::int64_t x_mm = 0, y_mm = 0;

  // Whole multiples of the step (millimetres) at or below a place.
  static LocalOrigin below(std::int64_t x_mm, std::int64_t y_mm, std::int64_t step_mm = 1000) {
    return {floor_div(x_mm, step_mm) * step_mm, floor_div(y_mm, step_mm) * step_mm};
  }
  double x_m() const { return static_cast<double>(x_mm) / 1000; }
  double y_m() const { return static_cast<double>(y_mm) / 1000; }
  float local_x(std::int64_t v_mm) const { return static_cast<float>(static_cast<double>(v_mm - x_mm) / 1000); }
  float local_y(std::int64_t v_mm) const { return static_cast<float>(static_cast<double>(v_mm - y_mm) / 1000); }
};

// A reference system as one line of a header.
inline std::string one_line(const std::string& wkt) {
  std::string line;
  bool space = false;
  for (const char c : wkt) {
    const bool blank = static_cast<unsigned char>(c) <= ' ';
    if (!blank)
      line += c;
    else if (!space && !line.empty())
      line += ' ';
    space = blank;
  }
  return line.empty() ? "unknown" : line;
}

}  // namespace btms
