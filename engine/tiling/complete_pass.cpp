#include <algorithm>

#include "engine/terrain/completion.h"
#include "engine/tiling/neighbour_index.h"
#include "engine/tiling/passes.h"

namespace btms {
namespace {

bool has_terrain(const Node* cell) {
  return std::any_of(cell, cell + kTriangles, [](const Node& n) { return n.node_class == NodeClass::kTerrain; });
}
bool needs_prediction(const Node* cell) {
  return std::any_of(cell, cell + kTriangles, [](const Node& n) { return n.node_class != NodeClass::kTerrain; });
}

// A flag per square of a box, row by row.
struct SquareMask {
  CellBox box;
  std::vector<std::uint8_t> flags;

  explicit SquareMask(const CellBox& b) : box(b), flags(static_cast<std::size_t>(b.cells()), 0) {}
  std::uint8_t& at(std::int32_t col, std::int32_t row) {
    return flags[static_cast<std::size_t>((std::int64_t{row} - box.row0) * box.cols() + (col - box.col0))];
  }
  bool any() const { return std::find(flags.begin(), flags.end(), 1) != flags.end(); }

  // Marks everything within `rings` rings of a marked square: along rows, then along columns.
  SquareMask dilated(std::int32_t rings) const {
    SquareMask wide(box), out(box);
    const auto cols = static_cast<std::int32_t>(box.cols()), rows = static_cast<std::int32_t>(box.rows());
    const auto spread = [rings](const std::uint8_t* from, std::uint8_t* to, std::int32_t n, std::int32_t stride) {
      std::int32_t until = -1;  // marked up to here
      for (std::int32_t i = 0; i < n; ++i) {
        if (i + rings < n && from[static_cast<std::ptrdiff_t>(i + rings) * stride]) until = i + 2 * rings;
        if (i <= until) to[static_cast<std::ptrdiff_t>(i) * stride] = 1;
      }
    };
    // The first `rings` squares of a line are looked at before the line starts.
    const auto spread_all = [&](const std::uint8_t* from, std::uint8_t* to, std::int32_t n, std::int32_t stride) {
      spread(from, to, n, stride);
      for (std::int32_t i = 0; i < std::min(rings, n); ++i)
        if (from[static_cast<std::ptrdiff_t>(i) * stride])
          for (std::int32_t k = 0; k <= std::min(n - 1, i + rings); ++k) to[static_cast<std::ptrdiff_t>(k) * stride] = 1;
    };
    for (std::int32_t row = 0; row < rows; ++row)
      spread_all(flags.data() + std::ptrdiff_t{row} * cols, wide.flags.data() + std::ptrdiff_t{row} * cols, cols, 1);
    for (std::int32_t col = 0; col < cols; ++col)
      spread_all(wide.flags.data() + col, out.flags.data() + col, rows, cols);
    return out;
  }
};

struct Scratch {
  Neighbourhood near;
  CompletionScratch completion;
  std::vector<Cell> squares;
};

void complete_tile(TileField<Node>& nodes, const CompletionRules& rules, double reach_cells, bool by_lattice, Scratch& s) {
  const CellBox& held = nodes.held();
  const CellBox& box = nodes.interior();
  const std::int32_t rings = rules.halo(), r = rules.resolution_mm;

  // Squares with terrain, the squares they reach, and of those the ones in the interior that want a prediction.
  SquareMask terrain(held), needy(held);
  for (std::int32_t row = held.row0; row < held.row1; ++row)
    for (std::int32_t col = held.col0; col < held.col1; ++col) terrain.at(col, row) = has_terrain(nodes.cell({col, row}));
  if (!terrain.any()) return;
  SquareMask reached = terrain.dilated(rings);
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for (std::int32_t col = box.col0; col < box.col1; ++col)
      needy.at(col, row) = reached.at(col, row) && needs_prediction(nodes.cell({col, row}));
  if (!needy.any()) return;
  // The index holds only terrain that a needy square can use.
  SquareMask wanted = needy.dilated(rings);
  for (std::size_t k = 0; k < wanted.flags.size(); ++k) wanted.flags[k] &= terrain.flags[k];

  const auto index = by_lattice ? lattice_index(nodes, wanted.flags, rings)
                                : nanoflann_index(nodes, wanted.flags, reach_cells);
  // Positions in a frame at the held box's corner: 32 bits of millimetres are 4000 km.
  const auto centre_x = [&](std::int32_t col) { return (col - held.col0) * r + r / 2; };
  const auto centre_y = [&](std::int32_t row) { return (row - held.row0) * r + r / 2; };

  for (std::int32_t row = box.row0; row < box.row1; row += 2)
    for (std::int32_t col = box.col0; col < box.col1; col += 2) {
      const CellBox group = CellBox{col, row, col + 2, row + 2}.intersect(box);
      bool any = false;
      for (std::int32_t y = group.row0; y < group.row1; ++y)
        for (std::int32_t x = group.col0; x < group.col1; ++x) any |= needy.at(x, y) != 0;
      if (!any) continue;

      index->near({col, row}, s.squares);
      s.near.clear();
      for (const Cell& c : s.squares) {
        const Node* cell = nodes.cell(c);
        for (int t = 0; t < kTriangles; ++t)
          if (cell[t].node_class == NodeClass::kTerrain)
            s.near.add(cell[t], centre_x(c.col) + cell[t].mean_x_mm, centre_y(c.row) + cell[t].mean_y_mm);
      }
      for (std::int32_t y = group.row0; y < group.row1; ++y)
        for (std::int32_t x = group.col0; x < group.col1; ++x) {
          if (!needy.at(x, y)) continue;
          Node* cell = nodes.cell({x, y});
          for (std::uint8_t t = 0; t < kTriangles; ++t)
            if (cell[t].node_class != NodeClass::kTerrain)
              predict(cell[t], t, centre_x(x), centre_y(y), s.near, rules, s.completion);
        }
    }
}

}  // namespace

std::int32_t complete_halo(const Parameters& p) { return CompletionRules(p).halo(); }

void complete_pass(const PassContext& context, bool neighbours_by_lattice, NodeFields& nodes) {
  const CompletionRules rules(context.parameters);
  std::vector<Scratch> scratch(static_cast<std::size_t>(context.threads.count()));
  context.for_each_tile("complete", [&](std::size_t i, int worker) {
    complete_tile(nodes[i], rules, context.parameters.kernel_radius, neighbours_by_lattice,
                  scratch[static_cast<std::size_t>(worker)]);
  });
}

}  // namespace btms
