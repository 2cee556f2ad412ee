#include "io/export/route_picture.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace btms {
namespace {

constexpr Rgb kRim{255, 255, 255};
constexpr double kRimWidth = 2;  // pixels

double distance(Place p, Place a, Place b) {
  const double dx = b.x_m - a.x_m, dy = b.y_m - a.y_m, length2 = dx * dx + dy * dy;
  const double share = length2 > 0 ? std::clamp(((p.x_m - a.x_m) * dx + (p.y_m - a.y_m) * dy) / length2, 0.0, 1.0) : 0;
  return std::hypot(p.x_m - a.x_m - share * dx, p.y_m - a.y_m - share * dy);
}

void blend(Picture& picture, int x, int y, Rgb colour, double share) {
  const auto mixed = [&](std::uint8_t below, std::uint8_t above) {
    return static_cast<std::uint8_t>(below + share * (above - below) + 0.5);
  };
  const Rgb b = picture.at(x, y);
  picture.set(x, y, {mixed(b.r, colour.r), mixed(b.g, colour.g), mixed(b.b, colour.b)});
}

}  // namespace

CellBox surroundings(std::span<const Place> places, const Lattice& lattice) {
  constexpr std::int32_t kLeastRoom = 20, kLeastWidth = 120;
  CellBox box;
  for (const Place& p : places) {
    const Cell c = lattice.cell_at(std::llround(p.x_m * 1000), std::llround(p.y_m * 1000));
    box = box.hull({c.col, c.row, c.col + 1, c.row + 1});
  }
  const auto longer = static_cast<std::int32_t>(std::max(box.cols(), box.rows()));
  const std::int32_t room = std::max({kLeastRoom, longer / 6, (kLeastWidth - longer) / 2});
  return box.grown(room);
}

void draw_way(Relief& relief, std::span<const Place> way, Rgb colour, double width) {
  Picture& picture = relief.picture;
  std::vector<Place> at;
  for (const Place& p : way) at.push_back(relief.on_picture(p));
  if (at.size() == 1) at.push_back(at[0]);
  // How far every pixel is from the line: blended once, it has no knots where pieces meet.
  const double reach = width / 2 + kRimWidth + 1;
  std::vector<float> away(static_cast<std::size_t>(picture.width()) * static_cast<std::size_t>(relief.height),
                          static_cast<float>(reach));
  const auto pixel = [](double v, int end) { return static_cast<int>(std::clamp(v, 0.0, static_cast<double>(end))); };
  for (std::size_t i = 1; i < at.size(); ++i) {
    const auto [x0, x1] = std::minmax(at[i - 1].x_m, at[i].x_m);
    const auto [y0, y1] = std::minmax(at[i - 1].y_m, at[i].y_m);
    for (int y = pixel(y0 - reach, relief.height); y < pixel(y1 + reach + 1, relief.height); ++y)
      for (int x = pixel(x0 - reach, picture.width()); x < pixel(x1 + reach + 1, picture.width()); ++x) {
        float& d =
            away[static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width()) + static_cast<std::size_t>(x)];
        d = std::min(d, static_cast<float>(distance({x + 0.5, y + 0.5}, at[i - 1], at[i])));
      }
  }
  for (int y = 0; y < relief.height; ++y)
    for (int x = 0; x < picture.width(); ++x) {
      const double d =
          away[static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width()) + static_cast<std::size_t>(x)];
      blend(picture, x, y, kRim, std::clamp(width / 2 + kRimWidth + 0.5 - d, 0.0, 1.0));
      blend(picture, x, y, colour, std::clamp(width / 2 + 0.5 - d, 0.0, 1.0));
    }
}

void draw_mark(Relief& relief, Place place, Rgb colour, std::string_view word) {
  constexpr double kDisc = 18;
  constexpr int kScale = 2, kGap = 6, kFont_px = 7 * kScale;
  draw_way(relief, std::span(&place, 1), colour, kDisc);
  const Place at = relief.on_picture(place);
  const int width = Picture::text_width(word, kScale);
  int x = static_cast<int>(at.x_m + kDisc / 2) + kGap;
  if (x + width + kGap > relief.picture.width()) x = static_cast<int>(at.x_m - kDisc / 2) - kGap - width;
  const int y = static_cast<int>(at.y_m) - kFont_px / 2;
  if (x < 3 || y < 3 || x + width + 3 > relief.picture.width() || y + kFont_px + 3 > relief.height) return;
  relief.picture.fill(x - 3, y - 3, width + 6, kFont_px + 6, kRim);
  relief.picture.text(x, y, word, kScale, colour);
}

}  // namespace btms
