#include "io/export/picture.h"

#include <algorithm>

#include "io/export/font.h"
#include "io/files/atomic_file.h"

namespace btms {

Picture::Picture(int width, int height, Rgb background)
    : width_(width),
      height_(height),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), background) {}

void Picture::fill(int x, int y, int width, int height, Rgb colour) {
  for (int row = std::max(y, 0); row < std::min(y + height, height_); ++row)
    for (int col = std::max(x, 0); col < std::min(x + width, width_); ++col) set(col, row, colour);
}

void Picture::text(int x, int y, std::string_view text, int scale, Rgb colour) {
  for (const char letter : text) {
    const auto glyph =
        std::find_if(std::begin(kFont), std::end(kFont), [&](const Glyph& g) { return g.letter == letter; });
    if (glyph != std::end(kFont))
      for (int row = 0; row < kGlyphHeight; ++row)
        for (int col = 0; col < kGlyphWidth; ++col)
          if (glyph->rows[row] >> (kGlyphWidth - 1 - col) & 1)
            fill(x + col * scale, y + row * scale, scale, scale, colour);
    x += (kGlyphWidth + 1) * scale;
  }
}

int Picture::text_width(std::string_view text, int scale) {
  return static_cast<int>(text.size()) * (kGlyphWidth + 1) * scale;
}

void Picture::write_png(const std::filesystem::path& file) const {
  write_file(file, png_of(static_cast<std::uint32_t>(width_), static_cast<std::uint32_t>(height_), pixels_));
}

}  // namespace btms
