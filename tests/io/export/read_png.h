// A picture as other programs see it.
#pragma once

#include <gtest/gtest.h>
#include <png.h>

#include <filesystem>
#include <fstream>
#include <span>
#include <vector>

#include "io/export/picture.h"

namespace btms {

inline Picture read_png(std::span<const std::uint8_t> bytes) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()), 0);
  image.format = PNG_FORMAT_RGB;
  std::vector<Rgb> pixels(std::size_t{image.width} * image.height);
  EXPECT_NE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr), 0);
  Picture p(static_cast<int>(image.width), static_cast<int>(image.height), {});
  for (int y = 0; y < p.height(); ++y)
    for (int x = 0; x < p.width(); ++x) p.set(x, y, pixels[static_cast<std::size_t>(y * p.width() + x)]);
  return p;
}

inline Picture read_png(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  return read_png(std::span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()));
}

}  // namespace btms
