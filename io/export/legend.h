// The strip below a picture: texts, swatches and a scale bar, from left to right.
#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "io/export/picture.h"

namespace btms {

struct LegendEntry {
  Rgb colour;
  std::string_view text;
};

// Lengths in dots of the font; a dot is `scale` pixels wide.
class Legend {
 public:
  static constexpr int kHeight = 23, kGap = 10;
  // Of the swatches, the longest scale bar there can be and the margins.
  static int width(std::span<const LegendEntry> swatches, int scale);

  // Draws into the last kHeight dots of `picture`, which must outlive this.
  Legend(Picture& picture, int scale);
  void text(std::string_view text, int gap = kGap);
  // `colour` of 0 at the left to 1 at the right.
  void box(int width, const std::function<Rgb(double)>& colour);
  void swatch(const LegendEntry& entry);
  void scale_bar(double metres_per_pixel);

 private:
  Picture& picture_;
  int scale_, x_, top_;  // x and top in pixels
};

}  // namespace btms
