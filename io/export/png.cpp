#include "io/export/png.h"

#include <png.h>

#include <string>

#include "engine/error.h"

namespace btms {
namespace {

std::vector<std::uint8_t> encode(std::uint32_t width, std::uint32_t height, std::uint32_t format, const void* pixels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = width;
  image.height = height;
  image.format = format;
  image.flags = PNG_IMAGE_FLAG_FAST;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<std::uint8_t> bytes(size);
  const bool written = png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels, 0, nullptr) != 0;
  const std::string message = image.message;
  png_image_free(&image);
  if (!written) throw Error(ErrorCode::kFailed, "could not encode the picture: " + message);
  bytes.resize(size);
  return bytes;
}

}  // namespace

std::vector<std::uint8_t> png_of(std::uint32_t width, std::uint32_t height, std::span<const Rgb> pixels) {
  static_assert(sizeof(Rgb) == 3);
  return encode(width, height, PNG_FORMAT_RGB, pixels.data());
}

std::vector<std::uint8_t> png_of(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> grey) {
  return encode(width, height, PNG_FORMAT_GRAY, grey.data());
}

}  // namespace btms
