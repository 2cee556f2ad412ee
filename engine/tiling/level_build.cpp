// The rounds of the coarse-to-fine method: fit, class, link, judge, complete, corners; the surface of a round is the
// prior of the next, and that of a level's last round the prior of the finer level.
#include <algorithm>
#include <array>
#include <cmath>

#include "engine/lattice/neighbours.h"
#include "engine/terrain/level_complete.h"
#include "engine/tiling/level_passes.h"
#include "engine/tiling/level_points.h"
#include "engine/tiling/level_scatter.h"
#include "engine/tiling/needy_walk.h"

namespace btms {
namespace {

using LevelFields = TileFields<LevelNode>;

// Where a round takes its prior from.
struct PriorSource {
  const Surfaces* surfaces = nullptr;  // nullptr: first level
  bool coarser = false;                // a level coarser than the nodes
  const SpanGrounds* spans = nullptr;  // what lies under bridges, where they have been looked for

  // Of the nodes of a square; of those outside they mean nothing.
  SquarePriors of(std::size_t tile, Cell c) const {
    if (!surfaces) return {};
    const LevelSurface& s = (*surfaces)[tile];
    return coarser ? s.planes_for_child(c) : s.planes_of(c);
  }
  // Under a bridge, in the square at this index of the tile's box.
  PriorPlane under(std::size_t tile, std::size_t square) const {
    const SpanGround& ground = (*spans)[tile][square];
    return {static_cast<double>(ground.z_mm), 0, 0, static_cast<double>(ground.sd_mm)};
  }
  // What a pass needs to ask for priors.
  Use use() const { return surfaces ? reads(*surfaces) : Use{}; }
  bool outside(std::size_t tile, NodeId n) const {
    return surfaces && (*surfaces)[tile].is_outside(coarser ? parent(n) : n);
  }
};

std::size_t square_of(const CellBox& box, Cell c) {
  return static_cast<std::size_t>((std::int64_t{c.row} - box.row0) * box.cols() + (c.col - box.col0));
}

// Nodes of one level and their classes, from the points: all of them on the last level, the lowest of each finest node
// before. Squares without points stay as they are. `ground`: its scatter per cell of the coarsest level, where the fit
// follows that.
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
        "fit", context.threads, context.progress,
        [&](std::size_t i, BinId id, const OrderedPoints::Bin& bin, int worker) {
          GatedPoints& gated = scratch[static_cast<std::size_t>(worker)].gated;
          const InUse tile({prior.use(), ground ? reads(*ground) : Use{}, writes(nodes)}, i);
          const LevelRules here = ground ? rules.following(around((*ground)[i], {id.bx, id.by}).rms_mm()) : rules;
          for_each_square(bin, cells_of(id, level),
                          [&](Cell c, const SquarePoints& square) { fit(i, c, square, here, gated); });
        });
    return;
  }
  points.for_each_lowest("fit", context.threads, context.progress,
                         [&](std::size_t i, BinId id, const OrderedPoints::Lowest& bin, int worker) {
                           Scratch& s = scratch[static_cast<std::size_t>(worker)];
                           const InUse tile({prior.use(), writes(nodes)}, i);
                           for_each_square(bin, points.order(), level, rules.r_mm(), cells_of(id, level), s.lowest,
                                           [&](Cell c, const SquarePoints& here) { fit(i, c, here, rules, s.gated); });
                         });
}

// The classes of nodes that have been fitted before.
void classify_level(const PassContext& context, const LevelRules& rules, const PriorSource& prior,
                    const LevelRegions& regions, LevelFields& nodes) {
  context.for_each_tile("class", {prior.use(), writes(nodes)}, [&](std::size_t i, int) {
    regions[i].for_each_cell([&](Cell c) {
      const SquarePriors priors = prior.of(i, c);
      for (std::uint8_t t = 0; t < kTriangles; ++t) classify(nodes[i].cell(c)[t], priors[t], rules);
    });
  });
}

// First level: what lies further from any point than kDomainRings is not part of the map.
void bound_domain(const PassContext& context, LevelFields& nodes) {
  const auto& tiles = context.table.tiles();
  exchange_halo(context.table, nodes, kDomainRings, context.threads, context.ranks);
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

// Step 7: fills `completed` (interior and one ring) from `nodes`.
void complete_level(const PassContext& context, const LevelRules& rules, const PriorSource& prior,
                    const LevelRegions& regions, bool by_lattice, const LevelFields& nodes, LevelFields& completed) {
  const auto& tiles = context.table.tiles();
  std::vector<CompleteScratch> scratch(static_cast<std::size_t>(context.threads.count()));
  const auto wants = [&](const LevelNode& n) {
    return n.level_class != LevelClass::kOutside && n.level_class != LevelClass::kSpan && !n.has_plane() &&
           (n.count > 0 || rules.completes_empty());
  };
  context.for_each_tile(
      "complete", {prior.use(), prior.spans ? reads(*prior.spans) : Use{}, reads(nodes), writes(completed)},
      [&](std::size_t i, int worker) {
        CompleteScratch& s = scratch[static_cast<std::size_t>(worker)];
        const TileField<LevelNode>& from = nodes[i];
        TileField<LevelNode>& to = completed[i];
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

}  // namespace

int rounds_of(const Parameters& p, int level) {
  const int last = level_count(p) - 1;
  if (level == 0) return 1;
  // Ridges and cliffs climb back in rounds: fit, judge anew with the new surface, fit again.
  if (level < last) return p.level_rounds;
  // A second round follows the ground's scatter about the surface of the first.
  return p.fit_scale_ground > 0 ? 2 : 1;
}

Levels build_levels(const Parameters& parameters, const TileTable& coarsest, const OrderedPoints& points,
                    const std::vector<TrajectoryPoint>& trajectory, bool labels_only, bool by_lattice,
                    const Threads& threads, Ranks& ranks, Pager& pager, Progress& progress,
                    const std::function<void(int)>& level_done) {
  const int levels = level_count(parameters);
  Levels built{coarsest, {}, {}};
  TileTable& table = built.table;
  Surfaces surfaces;
  std::vector<ScatterFields> misfits;  // one a refinement
  std::vector<LevelRegions> needed;    // a level, or none: everything
  if (labels_only && table.tiles().size() == 1 && ranks.size() == 1) {
    std::vector<int> rounds;
    for (int level = 0; level < levels; ++level) rounds.push_back(rounds_of(parameters, level));
    needed = under_points(table, points, rounds, threads, progress);
  }
  for (int level = 0; level < levels; ++level) {
    if (level > 0) table = table.finer();
    const bool first = level == 0, last = level == levels - 1;
    const LevelRules rules(parameters, table.layout().lattice.resolution_mm(), first, last);
    const PassContext context{parameters, table, threads, ranks, pager, progress, trajectory};
    const std::int32_t halo = std::max(rules.completion_halo(), kDomainRings);

    const auto& tiles = table.tiles();
    const LevelRegions regions =
        needed.empty() ? whole_tiles(table) : std::move(needed[static_cast<std::size_t>(level)]);
    LevelFields nodes(pager, tiles.size()), completed(pager, tiles.size());
    const PriorSource coarser = first ? PriorSource{} : PriorSource{&surfaces, true};
    context.for_each_tile("prior", {coarser.use(), writes(nodes), writes(completed)}, [&](std::size_t i, int) {
      nodes[i] = TileField<LevelNode>(tiles[i].box, halo);
      completed[i] = TileField<LevelNode>(tiles[i].box, kFitHalo);
      regions[i].for_each_node([&](NodeId n) {
        if (!coarser.outside(i, n)) nodes[i].cell(n.cell)[n.triangle].level_class = LevelClass::kEmpty;
      });
    });
    const int rounds = rounds_of(parameters, level);
    Surfaces own(pager, tiles.size());
    for (int round = 0; round < rounds; ++round) {
      PriorSource prior = round == 0 ? coarser : PriorSource{&own, false};
      if (last && round > 0) {
        const ScatterFields ground = measure_ground(context, coarsest, level, points, own);
        fit_level(context, points, level, rules, prior, &ground, nodes);
      } else if (round % 2 == 0) {
        fit_level(context, points, level, rules, prior, nullptr, nodes);
      } else {
        classify_level(context, rules, prior, regions, nodes);
      }
      if (first) bound_domain(context, nodes);
      exchange_halo(table, nodes, kLinkHalo, threads, ranks);
      built.components = judge_level(context, regions, rules, nodes);
      if (round == 0 && !first) misfits.push_back(measure_misfit(context, coarsest, level, nodes));
      SpanGrounds spans;
      if (last && !first && round == rounds - 1 && rules.p().span_width_m > 0) {
        spans = span_pass(context, rules, nodes);
        prior.spans = &spans;
      }
      exchange_halo(table, nodes, rules.completion_halo(), threads, ranks);
      complete_level(context, rules, prior, regions, by_lattice, nodes, completed);
      exchange_halo(table, completed, kFitHalo, threads, ranks);
      Surfaces next(pager, tiles.size());
      context.for_each_tile("corners", {reads(completed), writes(next)},
                            [&](std::size_t i, int) { next[i] = fit_surface(completed[i], regions[i], rules); });
      own = std::move(next);
    }
    if (last) {
      built.tiles = finish_levels(context, coarsest, points, rules, {nodes, completed, own, misfits});
    }
    surfaces = std::move(own);
    level_done(level);
  }
  return built;
}

}  // namespace btms
