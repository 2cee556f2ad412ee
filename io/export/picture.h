// An RGB picture in memory: rectangles, text, PNG.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "io/export/png.h"

namespace btms {

class Picture {
 public:
  Picture(int width, int height, Rgb background);

  int width() const { return width_; }
  int height() const { return height_; }
  Rgb at(int x, int y) const { return pixels_[index(x, y)]; }
  void set(int x, int y, Rgb colour) { pixels_[index(x, y)] = colour; }
  // Clipped to the picture.
  void fill(int x, int y, int width, int height, Rgb colour);
  // Top left corner at x, y; every dot of the font is scale x scale pixels. Letters the font lacks are left blank.
  void text(int x, int y, std::string_view text, int scale, Rgb colour);
  static int text_width(std::string_view text, int scale);

  // Whole file or none. Throws Error(kFailed).
  void write_png(const std::filesystem::path& file) const;

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }

  int width_, height_;
  std::vector<Rgb> pixels_;
};

}  // namespace btms
