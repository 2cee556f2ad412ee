#include <algorithm>

#include "engine/terrain/completion.h"
#include "engine/tiling/needy_walk.h"
#include "engine/tiling/passes.h"

namespace btms {
namespace {

bool has_terrain(const Node* cell) {
  return std::any_of(cell, cell + kTriangles, [](const Node& n) { return n.node_class == NodeClass::kTerrain; });
}
bool needs_prediction(const Node* cell) {
  return std::any_of(cell, cell + kTriangles, [](const Node& n) { return n.node_class != NodeClass::kTerrain; });
}

struct Scratch {
  Neighbourhood near;
  CompletionScratch completion;
  std::vector<Cell> squares;
};

void complete_tile(TileField<Node>& nodes, const CompletionRules& rules, double reach_cells, bool by_lattice,
                   Scratch& s) {
  const CellBox& held = nodes.held();
  const std::int32_t r = rules.resolution_mm;
  // Positions in a frame at the held box's corner: 32 bits of millimetres are 4000 km.
  const auto centre_x = [&](std::int32_t col) { return (col - held.col0) * r + r / 2; };
  const auto centre_y = [&](std::int32_t row) { return (row - held.row0) * r + r / 2; };

  NeedyWalk walk(nodes, rules.halo(), reach_cells, by_lattice, has_terrain, needs_prediction);
  walk.walk(
      s.squares,
      [&](const std::vector<Cell>& squares) {
        s.near.clear();
        for (const Cell& c : squares) {
          const Node* cell = nodes.cell(c);
          for (int t = 0; t < kTriangles; ++t)
            if (cell[t].node_class == NodeClass::kTerrain)
              s.near.add(cell[t], centre_x(c.col) + cell[t].mean_x_mm, centre_y(c.row) + cell[t].mean_y_mm);
        }
      },
      [&](Cell c) {
        Node* cell = nodes.cell(c);
        for (std::uint8_t t = 0; t < kTriangles; ++t)
          if (cell[t].node_class != NodeClass::kTerrain)
            predict(cell[t], t, centre_x(c.col), centre_y(c.row), s.near, rules, s.completion);
      });
}

}  // namespace

std::int32_t complete_halo(const Parameters& p) { return CompletionRules(p).halo(); }

void complete_pass(const PassContext& context, bool neighbours_by_lattice, NodeFields& nodes) {
  const CompletionRules rules(context.parameters);
  std::vector<Scratch> scratch(static_cast<std::size_t>(context.threads.count()));
  context.for_each_tile("complete", {writes(nodes)}, [&](std::size_t i, int worker) {
    complete_tile(nodes[i], rules, context.parameters.kernel_radius, neighbours_by_lattice,
                  scratch[static_cast<std::size_t>(worker)]);
  });
}

}  // namespace btms
