// A picture as other programs see it.
#pragma once

#include <gtest/gtest.h>
#include <png.h>

#include <filesystem>
#include <vector>

#include "io/export/picture.h"

namespace btms {

inline Picture read_png(const std::filesystem::path& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_file(&image, file.c_str()), 0);
  image.format = PNG_FORMAT_RGB;
  std::vector<Rgb> pixels(std::size_t{image.width} * image.height);
  EXPECT_NE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr), 0);
  Picture p(static_cast<int>(image.width), static_cast<int>(image.height), {});
  for (int y = 0; y < p.height(); ++y)
    for (int x = 0; x < p.width(); ++x) p.set(x, y, pixels[static_cast<std::size_t>(y * p.width() + x)]);
  return p;
}

}  // namespace btms
