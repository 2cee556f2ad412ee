#include "io/export/legend.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace btms {
namespace {

constexpr Rgb kInk{60, 60, 60};
constexpr int kMargin = 8, kSwatch = 10, kBar = 60;

// The longest of 1, 2, 5 x 10^n metres that is at most `limit_m`.
double round_length_m(double limit_m) {
  const double power = std::pow(10.0, std::floor(std::log10(limit_m)));
  for (const double f : {5.0, 2.0})
    if (f * power <= limit_m) return f * power;
  return power;
}

std::string length_text(double length_m) {
  const bool km = length_m >= 1000;
  std::string text = std::to_string(km ? length_m / 1000 : length_m);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text + (km ? " km" : " m");
}

}  // namespace

int Legend::width(std::span<const LegendEntry> swatches, int scale) {
  int width = 2 * kMargin + kBar + 5 + Picture::text_width("0.005 m", 1) + kGap;
  for (const LegendEntry& entry : swatches) width += kSwatch + 4 + Picture::text_width(entry.text, 1) + kGap;
  return width * scale;
}

Legend::Legend(Picture& picture, int scale)
    : picture_(picture), scale_(scale), x_(kMargin * scale), top_(picture.height() - (kHeight - 8) * scale) {}

void Legend::text(std::string_view text, int gap) {
  picture_.text(x_, top_, text, scale_, kInk);
  x_ += Picture::text_width(text, scale_) + gap * scale_;
}

void Legend::box(int width, const std::function<Rgb(double)>& colour) {
  const int s = scale_;
  picture_.fill(x_, top_ - s, width * s, 9 * s, kInk);
  for (int i = 1; i < width * s - 1; ++i)
    picture_.fill(x_ + i, top_ - s + 1, 1, 9 * s - 2, colour((i - 1.0) / (width * s - 3)));
  x_ += (width + 4) * s;
}

void Legend::swatch(const LegendEntry& entry) {
  box(kSwatch, [&](double) { return entry.colour; });
  text(entry.text);
}

void Legend::scale_bar(double metres_per_pixel) {
  const int s = scale_;
  const double bar_m = round_length_m(kBar * s * metres_per_pixel);
  const int bar = std::max(1, static_cast<int>(std::lround(bar_m / metres_per_pixel)));
  picture_.fill(x_, top_ + 3 * s, bar, s, kInk);
  picture_.fill(x_, top_, s, 7 * s, kInk);
  picture_.fill(x_ + bar - s, top_, s, 7 * s, kInk);
  x_ += bar + 5 * s;
  text(length_text(bar_m));
}

}  // namespace btms
