// A picture of labelled points from above, coloured by their verdicts, with a legend and a scale bar.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "engine/metrics/metrics.h"
#include "io/export/picture.h"

namespace btms {

inline constexpr std::uint32_t kVerdictPixels = 1600;

// Millimetres in the map frame; the upper ends are not part of it.
struct PlanBox {
  std::int64_t x0_mm = 0, y0_mm = 0, x1_mm = 0, y1_mm = 0;

  bool empty() const { return x0_mm >= x1_mm || y0_mm >= y1_mm; }
  bool contains(std::int64_t x_mm, std::int64_t y_mm) const {
    return x_mm >= x0_mm && x_mm < x1_mm && y_mm >= y0_mm && y_mm < y1_mm;
  }
};

// Precondition: the verdict is not kLeftOut.
Rgb verdict_colour(Verdict verdict);

// A pixel shows the worst verdict of the points near it (in the order of the enum), whatever order they come in: errors
// lie above the rest, and are never smaller than 3 pixels. Not thread-safe.
class VerdictPicture {
 public:
  // `points` in the box give the distance between them, and that the size of a pixel and of a dot. Precondition: the
  // box is not empty.
  VerdictPicture(const PlanBox& box, std::uint64_t points, std::uint32_t max_pixels = kVerdictPixels);

  // What lies outside of the box, or is left out, is not drawn.
  void draw(std::int64_t x_mm, std::int64_t y_mm, Verdict verdict);
  // North up, at most `max_pixels` wide or high; the legend is left out where it would not fit. Throws Error(kFailed).
  void write_png(const std::filesystem::path& png) const;

 private:
  PlanBox box_;
  int limit_;
  double pixel_mm_ = 1;
  int width_ = 1, height_ = 1, dot_ = 1;
  std::vector<Verdict> worst_;
};

}  // namespace btms
