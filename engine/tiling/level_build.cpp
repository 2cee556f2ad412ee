// The rounds of the coarse-to-fine method: fit, class, link, judge, complete, corners; the surface of a round is the
// prior of the next, and that of a level's last round the prior of the finer level. A build that follows another works
// on the tiles only whose inputs have changed, and where their results come out as they were, the change ends there.
#include <algorithm>
#include <optional>

#include "engine/tiling/level_nodes.h"
#include "engine/tiling/level_points.h"
#include "engine/tiling/level_steps.h"
#include "engine/tiling/level_surfaces.h"
#include "engine/tiling/needy_walk.h"
#include "engine/tiling/touched.h"

namespace btms {

int rounds_of(const Parameters& p, int level) {
  const int last = level_count(p) - 1;
  if (level == 0) return 1;
  // Ridges and cliffs climb back in rounds: fit, judge anew with the new surface, fit again.
  if (level < last) return p.level_rounds;
  // A second round follows the ground's scatter about the surface of the first.
  return p.fit_scale_ground > 0 ? 2 : 1;
}

namespace {

// Rounds of the levels before one.
int rounds_before(const Parameters& p, int level) {
  int rounds = 0;
  for (int l = 0; l < level; ++l) rounds += rounds_of(p, l);
  return rounds;
}

// The level to begin with: that after the last one an interrupted build has saved. The same on every rank that runs at
// the same time.
int first_level(const Parameters& p, const Records& records, Ranks& ranks) {
  std::int64_t level = 0;
  if (records.memory())
    for (int l = 1; l < level_count(p); ++l) {
      bool whole = records.memory()->interrupted_after(record_number(rounds_before(p, l) - 1, Step::kSurface));
      for (int k = 1; k < l; ++k)
        whole = whole && records.memory()->interrupted_after(record_number(rounds_before(p, k), Step::kMisfit));
      if (whole) level = l;
    }
  if (!ranks.in_step()) return static_cast<int>(level);
  for (const std::int64_t other : ranks.gather(std::vector<std::int64_t>{level})) level = std::min(level, other);
  return static_cast<int>(level);
}

// Cells of tiles within a ring of those that are wanted: all that a tile is completed for that isn't wanted itself.
LevelRegions wanted_parts(const TileTable& table, const LevelRegions& regions, const TileSet& wanted,
                          const TileSet& completed) {
  LevelRegions out = regions;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (wanted[i] || !completed[i]) continue;
    SquareMask rim(table.tiles()[i].box);
    table.for_each_overlap(rim.box.grown(kFitHalo), [&](std::size_t j, const CellBox&) {
      if (!wanted[j]) return;
      for_each_cell(table.tiles()[j].box.grown(kFitHalo).intersect(rim.box), [&](Cell c) { rim.at(c.col, c.row) = 1; });
    });
    out[i] = LevelRegion(rim);
  }
  return out;
}

// The cells with nodes that draw on changed ones when they are completed.
Changes drawn_on(const PassContext& context, const LevelRules& rules, const Changes& changes, LevelNodes& nodes) {
  const TileTable& table = context.table;
  const Changes reached = changes.grown(rules.completion_halo());
  std::vector<std::vector<CellBox>> parts(table.tiles().size());
  for (const auto* boxes : {&reached.boxes, &reached.gone})
    for (const CellBox& box : *boxes)
      table.for_each_overlap(box, [&](std::size_t i, const CellBox& part) { parts[i].push_back(part); });
  nodes.need(within(table, reached, 0));
  Changes out(parts.size());
  context.for_each_tile("compare", {reads(nodes.fields)}, [&](std::size_t i, int) {
    for (const CellBox& part : parts[i])
      for_each_node(part, [&](NodeId n) {
        if (wants_neighbours(nodes.fields[i].cell(n.cell)[n.triangle], rules))
          out.boxes[i] = out.boxes[i].hull({n.cell.col, n.cell.row, n.cell.col + 1, n.cell.row + 1});
      });
  });
  out.share(context.ranks);
  return out;
}

// What an interrupted build is taken up from, when it is time.
void checkpoint(const PassContext& context, const TileTable& coarsest, const Records& records,
                const RoundSurfaces& surfaces, const std::vector<ScatterFields>& misfits) {
  const std::vector<std::uint8_t> asked{records.memory()->time_to_save()};
  if (context.ranks.in_step() && context.ranks.gather(asked)[0] == 0) return;
  for (std::size_t l = 0; l < misfits.size(); ++l) {
    const int number = record_number(rounds_before(context.parameters, static_cast<int>(l) + 1), Step::kMisfit);
    context.for_each_tile("save", {reads(misfits[l])}, [&](std::size_t i, int) {
      const Tile& tile = coarsest.tiles()[i];
      records.checkpoint(number, tile.id, tile.box, cells_of(misfits[l][i]));
    });
    records.memory()->finish(number);
  }
  const int number = record_number(surfaces.round(), Step::kSurface);
  context.for_each_tile("save", {reads(surfaces.tiles())}, [&](std::size_t i, int) {
    const Tile& tile = surfaces.table().tiles()[i];
    const LevelSurface& s = surfaces.tiles()[i];
    records.checkpoint(number, tile.id, tile.box, s.corners, s.centres, s.source);
  });
  records.memory()->finish(number);
}

}  // namespace

Levels build_levels(const LevelInputs& in, const Threads& threads, Ranks& ranks, Pager& pager, Progress& progress,
                    const std::function<void(int)>& level_done) {
  const Parameters& parameters = in.parameters;
  const int levels = level_count(parameters);
  Records& records = in.records;
  Levels built{in.coarsest, {}, {}, {}, {}, {}};
  TileTable& table = built.table;
  const std::size_t n = table.tiles().size();
  std::vector<ScatterFields> misfits;  // one a refinement
  std::vector<LevelRegions> needed;    // a level, or none: everything
  if (in.labels_only && n == 1 && ranks.size() == 1) {
    std::vector<int> rounds;
    for (int level = 0; level < levels; ++level) rounds.push_back(rounds_of(parameters, level));
    needed = under_points(table, in.points, rounds, threads, progress);
  }
  const PassContext outset{parameters, in.coarsest, threads, ranks, pager, progress, in.trajectory};
  Changes touched = touched_cells(outset, in.points, records);  // on the level that is worked on, as all that follow
  Changes prior_changes(n), misfit_changes(n);                  // those of the coarsest level
  built.bound = touched.grown(kDomainRings);
  built.worked_on.assign(n, 0);

  RoundSurfaces surfaces;
  const int begin = first_level(parameters, records, ranks);
  for (int level = 0; level < begin; ++level) {
    if (level > 0) {
      table = table.finer();
      touched = touched.finer(), prior_changes = prior_changes.finer(), built.bound = built.bound.finer();
      const PassContext context{parameters, table, threads, ranks, pager, progress, in.trajectory};
      misfits.push_back(
          measure_misfit(context, in.coarsest, level, TileFields<LevelNode>(),
                         {records, record_number(rounds_before(parameters, level), Step::kMisfit), TileSet(n)})
              .fields);
    }
    if (level + 1 == begin) {
      surfaces = RoundSurfaces(table, pager, rounds_before(parameters, begin) - 1);
      prior_changes = Changes::everywhere(table);
    }
  }

  for (int level = begin; level < levels; ++level) {
    ranks.enter("level-" + std::to_string(level + 1));
    if (level > 0) {
      table = table.finer();
      touched = touched.finer(), prior_changes = prior_changes.finer(), built.bound = built.bound.finer();
    }
    const bool first = level == 0, last = level == levels - 1;
    const LevelRules rules(parameters, table.layout().lattice.resolution_mm(), first, last);
    const PassContext context{parameters, table, threads, ranks, pager, progress, in.trajectory};
    const std::int32_t halo = std::max(rules.completion_halo(), kDomainRings);
    const LevelRegions regions =
        needed.empty() ? whole_tiles(table) : std::move(needed[static_cast<std::size_t>(level)]);
    LevelNodes nodes(context, records, halo);
    LevelFields completed(pager, n);
    RoundSurfaces own;
    Changes fitted(n);
    const int rounds = rounds_of(parameters, level);
    for (int round = 0; round < rounds; ++round) {
      const int k = rounds_before(parameters, level) + round;
      const bool fits = round % 2 == 0 || last, finishes = last && round == rounds - 1;
      RoundSurfaces& prior_surfaces = round == 0 ? surfaces : own;

      // What the nodes follow from: points, the surface before, the ground's scatter, or the nodes before.
      Changes inputs = touched;
      inputs.add(prior_changes);
      if (!fits) inputs.add(fitted);
      std::optional<Measured> ground;
      if (last && round > 0) {
        TileSet anew = within(table, touched, 0);
        add(anew, within(table, prior_changes, 0));
        own.need(anew, context, records);
        ground = measure_ground(context, in.coarsest, level, in.points, own.tiles(),
                                {records, record_number(k, Step::kGround), anew});
        exchange_halo(in.coarsest, ground->fields, kScatterHalo, threads, ranks);
        Changes around = ground->changes.grown(kScatterHalo);
        for (int l = 0; l < level; ++l) around = around.finer();
        inputs.add(around);
        built.bound = built.bound.grown(kScatterHalo << level);
      }
      const TileSet fit = within(table, inputs, first ? kDomainRings : 0);
      add(built.worked_on, fit);
      if (!first) prior_surfaces.need(fit, context, records);
      PriorSource prior = first ? PriorSource{} : PriorSource{&prior_surfaces.tiles(), round == 0};

      if (!fits) nodes.need(fit);  // those of the round before
      TileSet created;
      nodes.begin(k, fit, created);
      context.on(created).for_each_tile("prior", {prior.use(), writes(nodes.fields)}, [&](std::size_t i, int) {
        nodes.create(i);
        regions[i].for_each_node([&](NodeId node) {
          if (!prior.outside(i, node)) nodes.fields[i].cell(node.cell)[node.triangle].level_class = LevelClass::kEmpty;
        });
      });
      if (fits)
        fit_level(context.on(fit), in.points, level, rules, prior, ground ? &ground->fields : nullptr, nodes.fields);
      else
        classify_level(context.on(fit), rules, prior, regions, nodes.fields);
      if (first) {
        nodes.need(within(table, fit, kDomainRings));
        exchange_halo(table, nodes.fields, kDomainRings, threads, ranks, &fit);
        bound_domain(context.on(fit), nodes.fields);
      }
      fitted = nodes.fitted(fit);
      fitted.gone = touched.gone;
      const Judgement judgement = judge_level(context, regions, rules, records, k, fitted, nodes);
      built.components = judgement.components;
      if (round == 0 && !first) {
        const TileSet anew = within(table, judgement.changes, 0);
        Measured misfit =
            measure_misfit(context, in.coarsest, level, nodes.fields, {records, record_number(k, Step::kMisfit), anew});
        misfit_changes.add(misfit.changes);
        misfits.push_back(std::move(misfit.fields));
      }

      // The tiles whose surface may be another one now.
      const bool spans = last && !first && finishes && rules.p().span_width_m > 0;
      const std::int32_t span_halo = spans ? SpanRules(rules.p(), rules.r_mm()).halo() : 0;
      const std::int32_t reach = rules.completion_halo() + kFitHalo + span_halo;
      Changes completed_anew = inputs;
      completed_anew.add(judgement.changes.grown(span_halo));
      if (records.follow()) completed_anew.add(drawn_on(context, rules, judgement.changes.grown(span_halo), nodes));
      TileSet wanted = within(table, completed_anew, kFitHalo);
      built.bound.add(judgement.overturned);
      built.bound = built.bound.grown(reach);
      if (finishes) {
        // What is finished also tells how the ground scatters, and how far levels were from each other, around it.
        Changes all = completed_anew.grown(kFitHalo).coarser(level);
        all.add(misfit_changes);
        add(wanted, within(in.coarsest, all, 2 * kScatterHalo));
        built.bound = built.bound.grown(2 * kScatterHalo << level);
      }
      add(built.worked_on, wanted);
      const TileSet completes = within(table, wanted, kFitHalo),
                    near = within(table, completes, rules.completion_halo());
      nodes.need(spans ? within(table, near, span_halo) : near);
      SpanGrounds grounds;
      if (spans) {
        grounds = span_pass(context, rules, near, nodes.fields);
        prior.spans = &grounds;
      }
      if (!first) prior_surfaces.need(completes, context, records);
      if (spans || !judgement.in_halos)
        exchange_halo(table, nodes.fields, rules.completion_halo(), threads, ranks, &completes);
      complete_level(context.on(completes), rules, prior,
                     records.follow() ? wanted_parts(table, regions, wanted, completes) : regions, in.by_lattice,
                     nodes.fields, completed);
      exchange_halo(table, completed, kFitHalo, threads, ranks, &wanted);
      RoundSurfaces next(table, pager, k);
      Changes surface_changes(n);
      context.on(wanted).for_each_tile("corners", {reads(completed), writes(next.tiles())}, [&](std::size_t i, int) {
        LevelSurface& surface = next.tiles()[i];
        surface = fit_surface(completed[i], regions[i], rules);
        if (!records.keep()) return;
        const Tile& tile = table.tiles()[i];
        LevelSurface before(surface.r_mm, surface.box);
        const bool known = records.follow() &&
                           records.load(record_number(k, Step::kSurface), tile.id, tile.box, before.corners,
                                        before.centres, before.source) &&
                           before.corners.size() == surface.corners.size() &&
                           before.centres.size() == surface.centres.size() &&
                           before.source.size() == surface.source.size();
        surface_changes.boxes[i] = known ? difference(surface, before) : tile.box;
        if (!surface_changes.boxes[i].empty())
          records.save(record_number(k, Step::kSurface), tile.id, tile.box, surface.corners, surface.centres,
                       surface.source);
      });
      records.finish(record_number(k, Step::kSurface));
      if (records.keep())
        surface_changes.share(ranks);
      else
        surface_changes = Changes::everywhere(table);
      next.have(wanted);
      own = std::move(next);
      prior_changes = std::move(surface_changes);
      if (finishes) {
        TileSet anew = within(table, touched, 0);
        add(anew, within(table, prior_changes, 0));
        built.finished = wanted;
        built.tiles =
            finish_levels(context, in.coarsest, in.points, rules, {nodes.fields, completed, own.tiles(), misfits},
                          {records, record_number(kAfterRounds, Step::kGround), anew}, wanted);
      }
    }
    surfaces = std::move(own);
    if (!last && records.memory() && !records.keep()) checkpoint(context, in.coarsest, records, surfaces, misfits);
    level_done(level);
  }
  return built;
}

}  // namespace btms
