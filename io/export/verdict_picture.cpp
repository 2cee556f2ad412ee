#include "io/export/verdict_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "io/export/legend.h"

namespace btms {
namespace {

constexpr Rgb kPaper{255, 255, 255};
constexpr double kPixelsPerPoint = 5;  // across, where there is room
constexpr int kSmallestError = 3;

const std::array<LegendEntry, 4>& swatches() {
  static const std::array<LegendEntry, 4> entries{{{verdict_colour(Verdict::kTerrain), "terrain"},
                                                   {verdict_colour(Verdict::kObject), "object"},
                                                   {verdict_colour(Verdict::kTypeOne), "terrain called object"},
                                                   {verdict_colour(Verdict::kTypeTwo), "object called terrain"}}};
  return entries;
}

}  // namespace

Rgb verdict_colour(Verdict verdict) {
  switch (verdict) {
    case Verdict::kTerrain:
      return {138, 202, 118};
    case Verdict::kObject:
      return {56, 56, 58};
    case Verdict::kTypeOne:
      return {24, 64, 226};
    case Verdict::kTypeTwo:
      return {222, 16, 32};
    default:
      return kPaper;
  }
}

VerdictPicture::VerdictPicture(const PlanBox& box, std::uint64_t points, std::uint32_t max_pixels)
    : box_(box), limit_(static_cast<int>(std::clamp<std::uint32_t>(max_pixels, 64, 20000))) {
  const bool with_legend = limit_ >= Legend::width(swatches(), 1);
  const int room = with_legend ? limit_ - 2 * Legend::kHeight : limit_;
  const auto wide_mm = static_cast<double>(box.x1_mm - box.x0_mm), high_mm = static_cast<double>(box.y1_mm - box.y0_mm);
  const double spacing_mm = std::sqrt(wide_mm * high_mm / static_cast<double>(std::max<std::uint64_t>(points, 1)));
  pixel_mm_ = std::max({spacing_mm / kPixelsPerPoint, wide_mm / limit_, high_mm / room, 1.0});
  width_ = std::clamp(static_cast<int>(std::ceil(wide_mm / pixel_mm_)), 1, limit_);
  height_ = std::clamp(static_cast<int>(std::ceil(high_mm / pixel_mm_)), 1, room);
  dot_ = 1 + static_cast<int>(std::lround(spacing_mm / pixel_mm_));  // points are scattered: a bit of overlap
  worst_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), Verdict::kLeftOut);
}

void VerdictPicture::draw(std::int64_t x_mm, std::int64_t y_mm, Verdict verdict) {
  if (!box_.contains(x_mm, y_mm)) return;
  const int dot = verdict >= Verdict::kTypeOne ? std::max(dot_, kSmallestError) : dot_;
  const int left = static_cast<int>(static_cast<double>(x_mm - box_.x0_mm) / pixel_mm_) - (dot - 1) / 2;
  const int top = height_ - 1 - static_cast<int>(static_cast<double>(y_mm - box_.y0_mm) / pixel_mm_) - (dot - 1) / 2;
  for (int y = std::max(top, 0); y < std::min(top + dot, height_); ++y)
    for (int x = std::max(left, 0); x < std::min(left + dot, width_); ++x) {
      Verdict& worst =
          worst_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
      worst = std::max(worst, verdict);
    }
}

void VerdictPicture::write_png(const std::filesystem::path& png) const {
  const int scale = width_ >= Legend::width(swatches(), 2) ? 2 : 1;
  const int legend_width = Legend::width(swatches(), scale);
  const bool with_legend = limit_ >= legend_width;
  const int width = with_legend ? std::max(width_, legend_width) : width_;
  Picture picture(width, height_ + (with_legend ? Legend::kHeight * scale : 0), kPaper);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      const std::size_t i =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
      picture.set((width - width_) / 2 + x, y, verdict_colour(worst_[i]));
    }
  if (with_legend) {
    Legend legend(picture, scale);
    for (const LegendEntry& entry : swatches()) legend.swatch(entry);
    legend.scale_bar(pixel_mm_ / 1000);
  }
  picture.write_png(png);
}

}  // namespace btms
