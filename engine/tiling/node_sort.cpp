#include "engine/tiling/node_sort.h"

#include <algorithm>
#include <bit>
#include <string>

#include "engine/error.h"
#include "engine/lattice/divider.h"
#include "engine/lattice/wide.h"
#include "engine/terrain/moments.h"

namespace btms {
namespace {

[[noreturn]] void refuse_crowded_node(const BinGrid& grid, const CellBox& box, std::size_t node, std::uint64_t points) {
  const auto cell = static_cast<std::int32_t>(node / kTriangles);
  const Cell c{box.col0 + cell % grid.edge_cells, box.row0 + cell / grid.edge_cells};
  throw Error(ErrorCode::kBadInput,
              std::to_string(points) +
                  " points in one node near x = " + std::to_string(grid.lattice.centre_x_mm(c) / 1000) +
                  " m, y = " + std::to_string(grid.lattice.centre_y_mm(c) / 1000) + " m, more than " +
                  std::to_string(kMaxNodePoints) + ": thin the input or choose a finer resolution");
}

void check_crowd(const PointBins::Bin& bin, const BinGrid& grid, std::span<const std::uint32_t> counts) {
  const auto most = std::max_element(counts.begin(), counts.end());
  if (*most > kMaxNodePoints)
    refuse_crowded_node(grid, grid.box_of(bin.id), static_cast<std::size_t>(most - counts.begin()), *most);
}

}  // namespace

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
  if (n > kMaxNodePoints) check_crowd(bin, grid, std::span(end_).subspan(1));
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
