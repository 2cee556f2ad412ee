#include <algorithm>

#include "engine/tiling/needy_walk.h"
#include "engine/tiling/passes.h"
#include "engine/tiling/tile_steps.h"

namespace btms {
namespace {

bool has_terrain(const Node* cell) {
  return std::any_of(cell, cell + kTriangles, [](const Node& n) { return n.node_class == NodeClass::kTerrain; });
}
bool needs_prediction(const Node* cell) {
  return std::any_of(cell, cell + kTriangles, [](const Node& n) { return n.node_class != NodeClass::kTerrain; });
}

}  // namespace

void complete_tile(TileField<Node>& nodes, const CompletionRules& rules, double reach_cells, bool by_lattice,
                   std::span<const std::uint8_t> asked, CompleteScratch& s) {
  if (rules.completion == Completion::kNone) return;
  const CellBox& held = nodes.held();
  const std::int32_t r = rules.resolution_mm;
  // Positions in a frame at the held box's corner: 32 bits of millimetres are 4000 km.
  const auto centre_x = [&](std::int32_t col) { return (col - held.col0) * r + r / 2; };
  const auto centre_y = [&](std::int32_t row) { return (row - held.row0) * r + r / 2; };

  // What a plane says is worked out once: every neighbour serves many predictions.
  s.terrain.clear();
  s.begin.assign(1, 0);
  for (std::int32_t row = held.row0; row < held.row1; ++row)
    for (std::int32_t col = held.col0; col < held.col1; ++col) {
      const Node* cell = nodes.cell({col, row});
      for (int t = 0; t < kTriangles; ++t)
        if (cell[t].node_class == NodeClass::kTerrain)
          s.terrain.push_back(
              neighbour_of(cell[t], centre_x(col) + cell[t].mean_x_mm, centre_y(row) + cell[t].mean_y_mm));
      s.begin.push_back(static_cast<std::uint32_t>(s.terrain.size()));
    }

  NeedyWalk walk(nodes, rules.halo(), reach_cells, by_lattice, 2, has_terrain, [&](const Node* cell) {
    const auto square = static_cast<std::size_t>(cell - nodes.values().data()) / kTriangles;
    return (asked.empty() || asked[square]) && needs_prediction(cell);
  });
  std::size_t n = 0;  // neighbours of the group at hand
  walk.walk(
      s.squares,
      [&](const std::vector<Cell>& squares) {
        s.near.resize(squares.size() * kTriangles);
        n = 0;
        for (const Cell& c : squares) {
          const std::size_t square = nodes.offset(c) / kTriangles;
          for (std::uint32_t i = s.begin[square]; i < s.begin[square + 1]; ++i) s.near[n++] = i;
        }
      },
      [&](Cell c) {
        predict_square(nodes.cell(c), centre_x(c.col), centre_y(c.row), s.terrain, {s.near.data(), n}, rules,
                       s.completion);
      });
}

std::int32_t complete_halo(const Parameters& p) { return CompletionRules(p).halo(); }

void complete_pass(const PassContext& context, bool neighbours_by_lattice, NodeFields& nodes) {
  const CompletionRules rules(context.parameters);
  std::vector<CompleteScratch> scratch(static_cast<std::size_t>(context.threads.count()));
  context.for_each_tile("complete", {writes(nodes)}, [&](std::size_t i, int worker) {
    complete_tile(nodes[i], rules, context.parameters.kernel_radius, neighbours_by_lattice, {},
                  scratch[static_cast<std::size_t>(worker)]);
  });
}

}  // namespace btms
