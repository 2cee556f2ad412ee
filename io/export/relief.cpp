#include "io/export/relief.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "engine/error.h"
#include "io/export/legend.h"
#include "io/export/shading.h"

namespace btms {
namespace {

constexpr Rgb kPaper{255, 255, 255};
constexpr int kMaxPixelsPerCell = 12;

// What the picture has to fit: where there is anything, and how steep it is.
struct Survey {
  CellBox box;
  double gradient_sum = 0;
  std::int64_t nodes = 0;
};

// fn(tile) of all that has squares in the box.
template <class Fn>
void for_each_tile(const TileSource& map, const CellBox& box, const Fn& fn) {
  const TileGrid& grid = map.layout().grid;
  for (const TileId id : map.tiles())
    if (!grid.box_of(id).intersect(box).empty())
      if (const auto tile = map.load(id)) fn(*tile);
}

Survey survey(const TileSource& map, const CellBox& box) {
  Survey s;
  for_each_tile(map, box, [&](const TerrainTile& tile) {
    const auto cols = static_cast<std::size_t>(tile.box.cols());
    for (std::size_t i = 0; i < tile.nodes.size(); ++i) {
      if (tile.nodes[i].state == NodeState::kUnknown) continue;
      const std::size_t cell = i / kTriangles;
      const std::int32_t col = tile.box.col0 + static_cast<std::int32_t>(cell % cols);
      const std::int32_t row = tile.box.row0 + static_cast<std::int32_t>(cell / cols);
      if (!box.contains({col, row})) continue;
      s.box = s.box.hull({col, row, col + 1, row + 1});
      const Gradient g = node_gradient(tile, i / kTriangles, static_cast<std::uint8_t>(i % kTriangles));
      s.gradient_sum += std::sqrt(g.east * g.east + g.north * g.north);
      ++s.nodes;
    }
  });
  return s;
}

// Flat land gets its relief exaggerated, up to 10 times.
double relief_of(const Survey& s) {
  constexpr double kWanted = 0.3;
  const double mean = s.nodes > 0 ? s.gradient_sum / static_cast<double>(s.nodes) : 0;
  return mean > 0 ? std::clamp(std::round(kWanted / mean), 1.0, 10.0) : 1;
}

// How squares become pixels: a square is `enlarged` pixels wide, or a pixel is `reduced` squares wide.
struct Zoom {
  int enlarged = 1, reduced = 1;
  int pixels(std::int64_t cells) const { return static_cast<int>((cells * enlarged + reduced - 1) / reduced); }
};

Zoom zoom_for(const CellBox& box, std::int64_t max_width, std::int64_t max_height) {
  const auto fit = [](std::int64_t cells, std::int64_t pixels) { return pixels / std::max<std::int64_t>(cells, 1); };
  const auto enlarged =
      std::min({fit(box.cols(), max_width), fit(box.rows(), max_height), std::int64_t{kMaxPixelsPerCell}});
  if (enlarged >= 1) return {static_cast<int>(enlarged), 1};
  const auto reduced = std::max(ceil_div(box.cols(), max_width), ceil_div(box.rows(), max_height));
  return {1, static_cast<int>(reduced)};
}

// Sums of colours; a pixel is the mean of the samples that fall on it.
class Canvas {
 public:
  Canvas(const CellBox& box, Zoom zoom)
      : box_(box),
        zoom_(zoom),
        width_(zoom.pixels(box.cols())),
        height_(zoom.pixels(box.rows())),
        sums_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {}

  void draw(const TerrainTile& tile, const PictureLayer& layer, double relief) {
    // Samples across a square, so that each of its triangles is met, also in squares smaller than a pixel.
    const int across = std::max(2 * zoom_.enlarged, zoom_.reduced < 8 ? 4 : 2);
    const CellBox part = tile.box.intersect(box_);
    for (std::int32_t row = part.row0; row < part.row1; ++row)
      for (std::int32_t col = part.col0; col < part.col1; ++col) {
        const std::size_t cell = tile.cell_index({col, row});
        std::array<Rgb, kTriangles> colour;
        bool empty = true;
        for (std::uint8_t t = 0; t < kTriangles; ++t) {
          const NodeState state = tile.nodes[cell * kTriangles + t].state;
          colour[t] = state == NodeState::kUnknown
                          ? kPaper
                          : shaded(layer.colour(tile, cell, t), node_gradient(tile, cell, t), relief);
          empty = empty && state == NodeState::kUnknown;
        }
        if (!empty) draw_square({col, row}, colour, across);
      }
  }

  void copy_to(Picture& picture, int left) const {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const Sum& s =
            sums_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
        const auto mean = [&](std::uint32_t sum) { return static_cast<std::uint8_t>((sum + s.n / 2) / s.n); };
        if (s.n > 0) picture.set(left + x, y, {mean(s.r), mean(s.g), mean(s.b)});
      }
  }

 private:
  struct Sum {
    std::uint32_t r = 0, g = 0, b = 0, n = 0;
  };

  void draw_square(Cell c, const std::array<Rgb, kTriangles>& colour, int across) {
    const std::int64_t left = std::int64_t{c.col} - box_.col0, top = std::int64_t{box_.row1} - 1 - c.row;
    for (int v = 0; v < across; ++v)
      for (int u = 0; u < across; ++u) {
        const Rgb rgb = colour[triangle_of(2 * u + 1 - across, across - 2 * v - 1)];
        const auto x = (left * across + u) * zoom_.enlarged / across / zoom_.reduced;
        const auto y = (top * across + v) * zoom_.enlarged / across / zoom_.reduced;
        Sum& s = sums_[static_cast<std::size_t>(y * width_ + x)];
        s.r += rgb.r;
        s.g += rgb.g;
        s.b += rgb.b;
        ++s.n;
      }
  }

  CellBox box_;
  Zoom zoom_;
  int width_, height_;
  std::vector<Sum> sums_;
};

constexpr int kRamp = 60;  // dots

std::vector<LegendEntry> swatches(const PictureLayer& layer) {
  std::vector<LegendEntry> entries = layer.exceptions;
  entries.push_back({kPaper, "unknown"});
  return entries;
}

int legend_width(const PictureLayer& layer, int scale) {
  int width = Legend::width(swatches(layer), 1) + Picture::text_width("relief x10", 1);
  if (!layer.low.empty())
    width += Picture::text_width(layer.name, 1) + Legend::kGap + Picture::text_width(layer.low, 1) + 4 + kRamp + 4 +
             Picture::text_width(layer.high, 1) + Legend::kGap;
  return width * scale;
}

void draw_legend(Picture& picture, const PictureLayer& layer, int scale, double metres_per_pixel, double relief) {
  Legend legend(picture, scale);
  if (!layer.low.empty()) {
    legend.text(layer.name);
    legend.text(layer.low, 4);
    legend.box(kRamp, ramp_colour);
    legend.text(layer.high);
  }
  for (const LegendEntry& entry : swatches(layer)) legend.swatch(entry);
  legend.scale_bar(metres_per_pixel);
  if (relief > 1) legend.text("relief x" + std::to_string(static_cast<int>(relief)), 0);
}

}  // namespace

Relief draw_relief(const TileSource& map, const CellBox& box, std::uint32_t max_pixels, const PictureLayer& layer) {
  const Survey s = survey(map, box);
  const double relief = relief_of(s);
  const int scale = max_pixels >= 1000 ? 2 : 1;
  const auto limit = static_cast<std::int64_t>(std::clamp<std::uint32_t>(max_pixels, 64, 20000));
  const bool with_legend = limit >= legend_width(layer, scale);
  const int strip = with_legend ? Legend::kHeight * scale : 0;
  const Zoom zoom = zoom_for(s.box, limit, limit - strip);

  Canvas canvas(s.box, zoom);
  for_each_tile(map, s.box, [&](const TerrainTile& tile) { canvas.draw(tile, layer, relief); });
  const int width = std::max(zoom.pixels(s.box.cols()), with_legend ? legend_width(layer, scale) : 1);
  Picture picture(width, std::max(1, zoom.pixels(s.box.rows()) + strip), kPaper);
  const int left = (width - zoom.pixels(s.box.cols())) / 2;
  canvas.copy_to(picture, left);
  const double r_m = map.layout().lattice.resolution_m(), pixel_m = r_m * zoom.reduced / zoom.enlarged;
  if (with_legend) draw_legend(picture, layer, scale, pixel_m, relief);
  return {std::move(picture), pixel_m, s.box.col0 * r_m - left * pixel_m, s.box.row1 * r_m, zoom.pixels(s.box.rows())};
}

void write_relief(const TileSource& map, const std::filesystem::path& png, std::uint32_t max_pixels,
                  const PictureLayer& layer) {
  constexpr auto kEnd = static_cast<std::int32_t>(kCellBias);
  draw_relief(map, {-kEnd, -kEnd, kEnd, kEnd}, max_pixels, layer).picture.write_png(png);
}

}  // namespace btms
