#include "engine/tiling/level_steps.h"

#include <algorithm>
#include <array>

#include "engine/lattice/neighbours.h"
#include "engine/terrain/level_complete.h"
#include "engine/tiling/level_points.h"
#include "engine/tiling/needy_walk.h"

namespace btms {
namespace {

std::size_t square_of(const CellBox& box, Cell c) {
  return static_cast<std::size_t>((std::int64_t{c.row} - box.row0) * box.cols() + (c.col - box.col0));
}

bool has_plane(const LevelNode* cell) {
  return std::any_of(cell, cell + kTriangles, [](const LevelNode& n) { return n.has_plane(); });
}

constexpr std::int32_t kGroup = 4;  // squares each way that are completed from the same choice

struct CompleteScratch {
  LevelNeighbourhood near;
  std::vector<LevelNeighbourhood::Square> planes;  // of the squares of a tile
  std::vector<Cell> squares;
  LevelCompletionScratch square;
};

}  // namespace

void fit_level(const PassContext& context, const OrderedPoints& points, int level, const LevelRules& rules,
               const PriorSource& prior, const ScatterFields* ground, LevelFields& nodes) {
  struct Scratch {
    GatedPoints gated;
    LowestScratch lowest;
  };
  std::vector<Scratch> scratch(static_cast<std::size_t>(context.threads.count()));
  const auto fit = [&](std::size_t i, Cell c, const SquarePoints& square, const LevelRules& fit_rules,
                       GatedPoints& gated) {
    SquarePriors priors = prior.of(i, c);
    LevelNode* to = nodes[i].cell(c);
    std::array<bool, kTriangles> outside;
    for (std::uint8_t t = 0; t < kTriangles; ++t)
      if ((outside[t] = prior.outside(i, {c, t}))) priors[t] = {};
    std::array<LevelNode, kTriangles> fitted;
    fit_level_square(square, priors, fit_rules, gated, fitted.data());
    for (std::uint8_t t = 0; t < kTriangles; ++t)
      if (!outside[t]) to[t] = fitted[t], classify(to[t], priors[t], rules);
  };
  if (rules.last()) {
    points.for_each_bin(
        "fit", context.threads, context.progress, context.only,
        [&](std::size_t i, BinId id, const OrderedPoints::Bin& bin, int worker) {
          GatedPoints& gated = scratch[static_cast<std::size_t>(worker)].gated;
          const InUse tile({prior.use(), ground ? reads(*ground) : Use{}, writes(nodes)}, i);
          const LevelRules here = ground ? rules.following(around((*ground)[i], {id.bx, id.by}).rms_mm()) : rules;
          for_each_square(bin, cells_of(id, level),
                          [&](Cell c, const SquarePoints& square) { fit(i, c, square, here, gated); });
        });
    return;
  }
  points.for_each_lowest("fit", context.threads, context.progress, context.only,
                         [&](std::size_t i, BinId id, const OrderedPoints::Lowest& bin, int worker) {
                           Scratch& s = scratch[static_cast<std::size_t>(worker)];
                           const InUse tile({prior.use(), writes(nodes)}, i);
                           for_each_square(bin, points.order(), level, rules.r_mm(), cells_of(id, level), s.lowest,
                                           [&](Cell c, const SquarePoints& here) { fit(i, c, here, rules, s.gated); });
                         });
}

void classify_level(const PassContext& context, const LevelRules& rules, const PriorSource& prior,
                    const LevelRegions& regions, LevelFields& nodes) {
  context.for_each_tile("class", {prior.use(), writes(nodes)}, [&](std::size_t i, int) {
    regions[i].for_each_cell([&](Cell c) {
      const SquarePriors priors = prior.of(i, c);
      for (std::uint8_t t = 0; t < kTriangles; ++t) classify(nodes[i].cell(c)[t], priors[t], rules);
    });
  });
}

void bound_domain(const PassContext& context, LevelFields& nodes) {
  const auto& tiles = context.table.tiles();
  context.for_each_tile("domain", {writes(nodes)}, [&](std::size_t i, int) {
    SquareMask occupied(nodes[i].held());
    const CellBox seen = tiles[i].box.grown(kDomainRings);
    for (std::int32_t row = seen.row0; row < seen.row1; ++row)
      for (std::int32_t col = seen.col0; col < seen.col1; ++col) {
        const LevelNode* cell = nodes[i].cell({col, row});
        occupied.at(col, row) = std::any_of(cell, cell + kTriangles, [](const LevelNode& n) { return n.count > 0; });
      }
    const SquareMask domain = occupied.dilated(kDomainRings);
    for_each_node(tiles[i].box, [&](NodeId n) {
      if (!domain.at(n.cell.col, n.cell.row)) nodes[i].cell(n.cell)[n.triangle].level_class = LevelClass::kOutside;
    });
  });
}

bool wants_neighbours(const LevelNode& n, const LevelRules& rules) {
  return n.level_class != LevelClass::kOutside && n.level_class != LevelClass::kSpan && !n.has_plane() &&
         (n.count > 0 || rules.completes_empty());
}

void complete_level(const PassContext& context, const LevelRules& rules, const PriorSource& prior,
                    const LevelRegions& regions, bool by_lattice, const LevelFields& nodes, LevelFields& completed) {
  const auto& tiles = context.table.tiles();
  std::vector<CompleteScratch> scratch(static_cast<std::size_t>(context.threads.count()));
  const auto wants = [&](const LevelNode& n) { return wants_neighbours(n, rules); };
  context.for_each_tile(
      "complete", {prior.use(), prior.spans ? reads(*prior.spans) : Use{}, reads(nodes), writes(completed)},
      [&](std::size_t i, int worker) {
        CompleteScratch& s = scratch[static_cast<std::size_t>(worker)];
        const TileField<LevelNode>& from = nodes[i];
        TileField<LevelNode>& to = completed[i];
        if (to.interior() != tiles[i].box) to = TileField<LevelNode>(tiles[i].box, kFitHalo);
        const CellBox& held = from.held();
        const std::int32_t r = rules.r_mm();
        const auto centre_x = [&](std::int32_t col) { return (col - held.col0) * r + r / 2; };
        const auto centre_y = [&](std::int32_t row) { return (row - held.row0) * r + r / 2; };
        const std::int32_t rings = rules.completion_halo();
        NeedyWalk walk(from, rings, rules.p().level_kernel_radius * (rules.first() ? 4 : 1), by_lattice, kGroup,
                       has_plane, [&](const LevelNode* cell) { return std::any_of(cell, cell + kTriangles, wants); });
        // What no neighbour reaches keeps the prior; on the first level it is not part of the map.
        regions[i].for_each_cell([&](Cell c) {
          const LevelNode* cell = from.cell(c);
          LevelNode* out = to.cell(c);
          std::copy_n(cell, kTriangles, out);
          if (std::all_of(cell, cell + kTriangles, [](const LevelNode& n) { return n.has_plane(); })) return;
          const bool needy = walk.needy(c);
          const SquarePriors priors = prior.of(i, c);
          for (std::uint8_t t = 0; t < kTriangles; ++t) {
            LevelNode& node = out[t];
            if (node.level_class == LevelClass::kOutside || node.has_plane() || (needy && wants(node))) continue;
            if (rules.first())
              node.level_class = LevelClass::kOutside;
            else if (node.level_class == LevelClass::kSpan)
              take_prior(node, t, prior.under(i, square_of(tiles[i].box, c)), rules);
            else
              take_prior(node, t, priors[t], rules);
          }
        });
        // Every plane serves many squares.
        s.near.clear();
        s.planes.resize(static_cast<std::size_t>(held.cells()));
        for_each_cell(held, [&](Cell c) {
          if (walk.wanted(c)) s.planes[square_of(held, c)] = s.near.add(from.cell(c), centre_x(c.col), centre_y(c.row));
        });
        walk.walk(
            s.squares,
            [&](const std::vector<Cell>& squares) {
              s.near.choose_none();
              for (const Cell& c : squares) s.near.choose(s.planes[square_of(held, c)]);
            },
            [&](Cell c) {
              std::array<bool, kTriangles> wanted;
              std::transform(from.cell(c), from.cell(c) + kTriangles, wanted.begin(), wants);
              complete_level_square(to.cell(c), wanted, centre_x(c.col), centre_y(c.row), s.near, prior.of(i, c), rules,
                                    s.square);
            });
      });
}

LevelSurface fit_surface(const TileField<LevelNode>& nodes, const LevelRegion& region, const LevelRules& rules) {
  LevelSurface s(rules.r_mm(), nodes.interior());
  const CornerRules fit(rules);
  PlaneRow south, north;
  const auto assign = [&](PlaneRow& to, std::int32_t row, std::int32_t col0, std::int32_t col1) {
    to.assign(nodes.values().subspan(nodes.offset({col0, row}), static_cast<std::size_t>(col1 - col0) * kTriangles));
  };
  LevelRegion::Run before{};
  for (const LevelRegion::Run& run : region.corners()) {
    // The squares around the corners.
    if (&run != region.corners().data() && run.continues(before))
      std::swap(south, north);
    else
      assign(south, run.row - 1, run.col0 - 1, run.col1);
    assign(north, run.row, run.col0 - 1, run.col1);
    fit.corners(south, north,
                std::span(s.corners).subspan(s.corner_index({run.col0, run.row}),
                                             static_cast<std::size_t>(run.col1 - run.col0)));
    before = run;
  }
  for (const LevelRegion::Run& run : region.squares()) {
    assign(north, run.row, run.col0 - 1, run.col1 + 1);
    fit.centres(north, std::span(s.centres).subspan(s.cell_index({run.col0, run.row}),
                                                    static_cast<std::size_t>(run.col1 - run.col0)));
  }
  region.for_each_node([&](NodeId n) {
    const LevelNode& node = nodes.cell(n.cell)[n.triangle];
    if (node.level_class != LevelClass::kOutside)
      s.source[s.cell_index(n.cell) * kTriangles + n.triangle] = node.source;
  });
  return s;
}

}  // namespace btms
