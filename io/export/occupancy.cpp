#include "io/export/occupancy.h"

#include <cmath>
#include <limits>

#include "engine/model/terrain_tile.h"
#include "io/export/png.h"

namespace btms {
namespace {

constexpr std::uint8_t kFree = 254, kOccupied = 0, kUnknown = 205;  // trinary
constexpr std::uint8_t kRawOccupied = 100, kRawUnknown = 255;

// Lower envelope of parabolas: the squared distance to the nearest marked place of a line (Felzenszwalb and
// Huttenlocher), exact.
void distances2(const double* f, std::size_t n, std::size_t stride, double* out, std::vector<std::size_t>& at,
                std::vector<double>& from) {
  at.assign(n, 0);
  from.assign(n + 1, 0);
  std::size_t k = 0;
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const auto height = [&](std::size_t q) { return f[q * stride]; };
  std::size_t first = 0;
  while (first < n && height(first) == kInfinite) ++first;
  if (first == n) {
    for (std::size_t q = 0; q < n; ++q) out[q] = kInfinite;
    return;
  }
  at[0] = first;
  from[0] = -kInfinite;
  from[1] = kInfinite;
  for (std::size_t q = first + 1; q < n; ++q) {
    if (height(q) == kInfinite) continue;
    const auto meet = [&](std::size_t p) {
      const double a = static_cast<double>(q), b = static_cast<double>(p);
      return ((height(q) + a * a) - (height(p) + b * b)) / (2 * a - 2 * b);
    };
    double s = meet(at[k]);
    while (s <= from[k]) s = meet(at[--k]);
    at[++k] = q;
    from[k] = s;
    from[k + 1] = kInfinite;
  }
  for (std::size_t q = 0, i = 0; q < n; ++q) {
    while (from[i + 1] < static_cast<double>(q)) ++i;
    const double d = static_cast<double>(q) - static_cast<double>(at[i]);
    out[q] = d * d + height(at[i]);
  }
}

// Of every square to the nearest that is marked, in squares.
std::vector<double> distances2(const std::vector<bool>& marked, std::size_t rows, std::size_t cols) {
  std::vector<double> d(rows * cols), line(std::max(rows, cols)), from;
  std::vector<std::size_t> at;
  for (std::size_t i = 0; i < d.size(); ++i) d[i] = marked[i] ? 0 : std::numeric_limits<double>::infinity();
  for (std::size_t col = 0; col < cols; ++col) {
    distances2(d.data() + col, rows, cols, line.data(), at, from);
    for (std::size_t row = 0; row < rows; ++row) d[row * cols + col] = line[row];
  }
  for (std::size_t row = 0; row < rows; ++row) {
    distances2(d.data() + row * cols, cols, 1, line.data(), at, from);
    for (std::size_t col = 0; col < cols; ++col) d[row * cols + col] = line[col];
  }
  return d;
}

}  // namespace

const char* occupancy_mode_name(OccupancyMode mode) { return mode == OccupancyMode::kRaw ? "raw" : "trinary"; }

Occupancy occupancy_of(const Window& window, OccupancyMode mode, double inflation_m) {
  const std::vector<float>&cost = window.values[0], &kind = window.values[1];
  const std::size_t n = cost.size();
  std::vector<bool> blocked(n);
  const auto unknown = [&](std::size_t i) {
    return std::isnan(kind[i]) || kind[i] == static_cast<float>(NodeState::kUnknown);
  };
  for (std::size_t i = 0; i < n; ++i) blocked[i] = !unknown(i) && std::isnan(cost[i]);
  if (inflation_m > 0) {
    const double reach = inflation_m / window.cell_m, reach2 = reach * reach;
    const std::vector<double> d2 = distances2(blocked, window.rows, window.cols);
    for (std::size_t i = 0; i < n; ++i) blocked[i] = d2[i] <= reach2;
  }
  Occupancy out{mode, window.rows, window.cols, window.min_x_m, window.min_y_m, window.cell_m, {}};
  out.pixels.resize(n);
  const bool raw = mode == OccupancyMode::kRaw;
  for (std::size_t i = 0; i < n; ++i)
    out.pixels[i] = blocked[i]   ? raw ? kRawOccupied : kOccupied
                    : unknown(i) ? raw ? kRawUnknown : kUnknown
                    : raw        ? static_cast<std::uint8_t>(std::floor(static_cast<double>(cost[i]) * 99 + 0.5))
                                 : kFree;
  return out;
}

std::vector<std::uint8_t> Occupancy::pgm() const {
  const std::string head = "P5\n" + std::to_string(cols) + " " + std::to_string(rows) + "\n255\n";
  std::vector<std::uint8_t> out(head.begin(), head.end());
  out.insert(out.end(), pixels.begin(), pixels.end());
  return out;
}

std::vector<std::uint8_t> Occupancy::png() const {
  return png_of(static_cast<std::uint32_t>(cols), static_cast<std::uint32_t>(rows), pixels);
}

std::string Occupancy::yaml(const std::string& image) const {
  const auto number = [](double v) {
    char text[32];
    std::snprintf(text, sizeof text, "%.17g", v);
    return std::string(text);
  };
  return "image: " + image + "\nmode: " + occupancy_mode_name(mode) + "\nresolution: " + number(cell_m) +
         "\norigin: [" + number(min_x_m) + ", " + number(min_y_m) +
         ", 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
}

}  // namespace btms
