// Pass "span": nodes that lie on a bridge deck are no terrain; what lies under them is known from both sides.
#include "engine/terrain/span.h"

#include <algorithm>
#include <utility>

#include "engine/tiling/level_passes.h"

namespace btms {

SpanGrounds span_pass(const PassContext& context, const LevelRules& rules, const TileSet& wanted,
                      TileFields<LevelNode>& nodes) {
  const auto& tiles = context.table.tiles();
  const SpanRules span(rules.p(), rules.r_mm());
  TileFields<std::int32_t> heights(context.pager, tiles.size());
  const TileSet seen = within(context.table, wanted, span.halo());
  context.on(seen).for_each_tile("heights", {reads(nodes), writes(heights)}, [&](std::size_t i, int) {
    heights[i] = TileField<std::int32_t>(tiles[i].box, span.halo());
    std::fill(heights[i].values().begin(), heights[i].values().end(), kUnknownHeight_mm);
    const CellBox& box = tiles[i].box;
    for (std::int32_t row = box.row0; row < box.row1; ++row)
      for (std::int32_t col = box.col0; col < box.col1; ++col)
        for (int t = 0; t < kTriangles; ++t)
          if (const LevelNode& node = nodes[i].cell({col, row})[t]; node.has_plane())
            heights[i].cell({col, row})[t] = node.mean_z_mm;
  });
  exchange_halo(context.table, heights, span.halo(), context.threads, context.ranks, &wanted);

  SpanGrounds grounds(context.pager, tiles.size());
  context.on(wanted).for_each_tile("span", {writes(nodes), writes(heights), writes(grounds)}, [&](std::size_t i, int) {
    const CellBox &held = heights[i].held(), &box = tiles[i].box;
    std::vector<SquareHeights> squares(static_cast<std::size_t>(held.cells()));
    const std::span<const std::int32_t> height = std::as_const(heights[i]).values();
    for (std::size_t k = 0; k < squares.size(); ++k)
      squares[k] = square_heights(height.subspan(k * kTriangles, kTriangles), span);
    heights[i] = {};
    grounds[i] = find_spans(squares, box, span);
    for (std::size_t k = 0; k < grounds[i].size(); ++k) {
      if (!grounds[i][k].known()) continue;
      LevelNode* cell =
          nodes[i].cell({box.col0 + static_cast<std::int32_t>(static_cast<std::int64_t>(k) % box.cols()),
                         box.row0 + static_cast<std::int32_t>(static_cast<std::int64_t>(k) / box.cols())});
      for (int t = 0; t < kTriangles; ++t) {
        if (cell[t].level_class == LevelClass::kOutside) continue;
        const bool is_ground =  // what lies as low as the ground
            cell[t].has_plane() && 3 * (std::int64_t{cell[t].mean_z_mm} - grounds[i][k].z_mm) <= span.drop_mm;
        if (!is_ground) cell[t].level_class = LevelClass::kSpan;
      }
    }
  });
  return grounds;
}

}  // namespace btms
