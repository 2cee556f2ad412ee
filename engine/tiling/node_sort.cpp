#include "engine/tiling/node_sort.h"

#include <bit>

#include "engine/lattice/divider.h"
#include "engine/lattice/wide.h"

namespace btms {

BTMS_WIDE void NodeSort::sort(const PointBins::Bin& bin, const BinGrid& grid) {
  const auto n = static_cast<std::size_t>(bin.size);
  const auto b = static_cast<std::uint32_t>(grid.edge_cells);
  const auto r = static_cast<std::uint32_t>(grid.lattice.resolution_mm());
  const int bits = std::countr_zero(b);  // b is a power of two
  const std::size_t nodes = std::size_t{b} * b * kTriangles;
  if (key_.size() < n) {
    key_.resize(n);
    x_.resize(n);
    y_.resize(n);
    z_.resize(n);
  }
  const Divider divide(r);
  std::size_t at = 0;
  for (const PointBins::Run& run : bin.runs) {
    std::uint16_t* key = key_.data() + at;
    for (std::uint32_t i = 0; i < run.size; ++i) {
      const std::uint32_t x = run.points[i].x_mm, y = run.points[i].y_mm;
      const std::uint32_t col = divide(x), row = divide(y);
      const std::int32_t u2 = static_cast<std::int32_t>(2 * (x - col * r) - r);
      const std::int32_t v2 = static_cast<std::int32_t>(2 * (y - row * r) - r);
      key[i] = static_cast<std::uint16_t>((row * b + col) * kTriangles + triangle_of(u2, v2));
    }
    at += run.size;
  }

  end_.assign(nodes + 1, 0);
  for (std::size_t i = 0; i < n; ++i) ++end_[key_[i] + 1u];
  for (std::size_t k = 0; k < nodes; ++k) end_[k + 1] += end_[k];
  const std::int32_t half = static_cast<std::int32_t>(r / 2);
  at = 0;
  for (const PointBins::Run& run : bin.runs)
    for (std::uint32_t i = 0; i < run.size; ++i, ++at) {
      const std::uint32_t k = key_[at], cell = k / kTriangles;
      const std::uint32_t to = end_[k]++;  // afterwards end[k] is where node k ends
      x_[to] = static_cast<std::int16_t>(run.points[i].x_mm - static_cast<std::int32_t>((cell & (b - 1)) * r) - half);
      y_[to] = static_cast<std::int16_t>(run.points[i].y_mm - static_cast<std::int32_t>((cell >> bits) * r) - half);
      z_[to] = run.points[i].z_mm;
    }
}

}  // namespace btms
