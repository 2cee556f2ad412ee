#include "engine/tiling/level_region.h"

#include "engine/tiling/level_points.h"

namespace btms {
namespace {

// Calls fn(run) for the runs of a row of flags; `first` is the column of the first flag.
template <class Flag, class Fn>
void for_each_run(std::int32_t row, std::int32_t first, std::int32_t n, const Flag& flag, const Fn& fn) {
  for (std::int32_t i = 0; i < n; ++i) {
    if (!flag(i)) continue;
    const std::int32_t begin = i;
    while (i < n && flag(i)) ++i;
    fn(LevelRegion::Run{row, first + begin, first + i});
  }
}

// The squares of the coarser lattice that hold marked ones.
SquareMask parents(const SquareMask& fine, const CellBox& box) {
  SquareMask out(box);
  for (std::int32_t row = fine.box.row0; row < fine.box.row1; ++row)
    for (std::int32_t col = fine.box.col0; col < fine.box.col1; ++col)
      if (fine.at(col, row)) {
        const Cell c = parent({{col, row}, 0}).cell;
        out.at(c.col, c.row) = 1;
      }
  return out;
}

}  // namespace

LevelRegion::LevelRegion(const CellBox& all) : square_count_(static_cast<std::size_t>(all.cells())) {
  for (std::int32_t row = all.row0; row < all.row1; ++row) squares_.push_back({row, all.col0, all.col1});
  for (std::int32_t row = all.row0; row <= all.row1; ++row) corners_.push_back({row, all.col0, all.col1 + 1});
}

LevelRegion::LevelRegion(const SquareMask& mask) {
  const CellBox& box = mask.box;
  const auto cols = static_cast<std::int32_t>(box.cols());
  const auto marked = [&](std::int32_t col, std::int32_t row) {
    return col >= box.col0 && col < box.col1 && row >= box.row0 && row < box.row1 && mask.at(col, row) != 0;
  };
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for_each_run(
        row, box.col0, cols, [&](std::int32_t i) { return mask.at(box.col0 + i, row) != 0; },
        [&](const Run& run) {
          squares_.push_back(run);
          square_count_ += static_cast<std::size_t>(run.col1 - run.col0);
        });
  for (std::int32_t row = box.row0; row <= box.row1; ++row)
    for_each_run(
        row, box.col0, cols + 1,
        [&](std::int32_t i) {
          const std::int32_t col = box.col0 + i;
          return marked(col, row) || marked(col - 1, row) || marked(col, row - 1) || marked(col - 1, row - 1);
        },
        [&](const Run& run) { corners_.push_back(run); });
}

LevelRegions whole_tiles(const TileTable& table) {
  LevelRegions out;
  for (const Tile& tile : table.tiles()) out.emplace_back(tile.box);
  return out;
}

std::vector<LevelRegions> under_points(const TileTable& coarsest, const OrderedPoints& points,
                                       const std::vector<int>& rounds, const Threads& threads, Progress& progress) {
  const auto box_of = [&](int level) {
    const CellBox& b = coarsest.tiles()[0].box;
    const std::int32_t k = 1 << level;
    return CellBox{b.col0 * k, b.row0 * k, b.col1 * k, b.row1 * k};
  };
  int level = static_cast<int>(rounds.size()) - 1;
  SquareMask needed(box_of(level));
  points.for_each_bin(
      "region", threads, progress, nullptr, [&](std::size_t, BinId id, const OrderedPoints::Bin& bin, int) {
        for_each_square(bin, cells_of(id, level), [&](Cell c, const SquarePoints&) { needed.at(c.col, c.row) = 1; });
      });
  std::vector<LevelRegions> out(rounds.size());
  for (; level >= 0; --level) {
    // A surface depends on the nodes one square around it, and those on the surface of the round before.
    const SquareMask wide = needed.dilated(rounds[static_cast<std::size_t>(level)]);
    out[static_cast<std::size_t>(level)].emplace_back(wide);
    if (level > 0) needed = parents(wide, box_of(level - 1));
  }
  return out;
}

}  // namespace btms
