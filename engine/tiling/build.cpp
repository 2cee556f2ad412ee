#include "engine/tiling/build.h"

#include <algorithm>
#include <chrono>

#include "engine/error.h"
#include "engine/tiling/finished_tiles.h"
#include "engine/tiling/level_passes.h"
#include "engine/tiling/memory_budget.h"
#include "engine/tiling/passes.h"
#include "engine/tiling/point_bins.h"
#include "engine/tiling/strays.h"
#include "engine/tiling/tile_table.h"

namespace btms {
namespace {

constexpr std::int32_t kDefaultTileCells = 128;  // of the finest level

class Stopwatch {
 public:
  explicit Stopwatch(const Ranks& ranks) : ranks_(ranks), sent_(ranks.traffic()) {}
  // Seconds and this rank's traffic since the last call, filed under `phase`.
  void lap(const std::string& phase, std::vector<PhaseTime>& phases) {
    const auto now = std::chrono::steady_clock::now();
    const Traffic sent = ranks_.traffic();
    phases.push_back({phase,
                      std::chrono::duration<double>(now - last_).count(),
                      {sent.sent_bytes - sent_.sent_bytes, sent.shared_bytes - sent_.shared_bytes}});
    last_ = now;
    sent_ = sent;
  }

 private:
  const Ranks& ranks_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  Traffic sent_;
};

std::vector<OccupiedBin> occupied_bins(const PointBins& bins) {
  std::vector<OccupiedBin> out;
  for (std::size_t k = 0; k < bins.size(); ++k) out.push_back({bins.id(k), bins.points_in(k)});
  return out;
}

std::array<double, 4> extent_of(std::span<const BinId> bins, const BinGrid& grid) {
  CellBox hull;
  for (const BinId& b : bins) hull = hull.hull(grid.box_of(b));
  const double r = grid.lattice.resolution_m();
  return {hull.col0 * r, hull.row0 * r, hull.col1 * r, hull.row1 * r};
}

// From this rank's bytes to those of all.
void add_up_bytes(Ranks& ranks, BuildSummary& summary) {
  std::vector<PhaseTime>& phases = summary.phases;
  std::vector<std::uint64_t> bytes;
  for (const PhaseTime& phase : phases)
    bytes.insert(bytes.end(), {phase.traffic.sent_bytes, phase.traffic.shared_bytes});
  bytes.push_back(summary.spilled_bytes);
  const std::vector<std::uint64_t> sums = ranks.sum(bytes);
  for (std::size_t i = 0; i < phases.size(); ++i) phases[i].traffic = {sums[2 * i], sums[2 * i + 1]};
  summary.spilled_bytes = sums.back();
}

// The tiles leave the engine; what all ranks have made.
void commit(const PassContext& context, FinalTiles&& finished, TileSink& sink, BuildSummary& summary) {
  const CommitSummary mine = commit_pass(context, std::move(finished), sink);
  const CommitSummary done = context.ranks.sum<CommitSummary>({mine})[0];
  summary.tiles = done.tiles;
  summary.nodes = done.nodes();
  summary.observed = done.observed;
  summary.predicted = done.predicted;
  summary.obstacle = done.obstacle;
  summary.filled = done.filled;
  summary.unknown = done.unknown;
  summary.tiles_renewed = done.renewed;
  summary.digest = done.digest;
  summary.spilled_bytes = context.pager.spill().bytes_written();
}

// Before hours of work: is there room for what the budget doesn't hold?
void check_disk(const std::filesystem::path& spill_folder, double held_bytes, double budget_bytes) {
  if (held_bytes > budget_bytes)
    require_disk(spill_folder, static_cast<std::uint64_t>(held_bytes - budget_bytes),
                 "name another folder with --spill, or allow more --memory");
}

double nodes_of(const TileTable& table, int refinements) {
  double nodes = 0;
  for (const Tile& tile : table.tiles()) nodes += static_cast<double>(tile.box.cells()) * kTriangles;
  return nodes * static_cast<double>(1 << (2 * refinements));
}

MapLayout finest_layout(const TileTable& coarsest, int levels) {
  TileTable table = coarsest;
  for (int i = 1; i < levels; ++i) table = table.finer();
  return table.layout();
}

}  // namespace

std::int32_t tile_cells(const BuildOptions& options) {
  return options.tile_cells.value_or(std::max(1, kDefaultTileCells >> (level_count(options.parameters) - 1)));
}

BuildSummary build_map(std::span<const PointSource* const> sources, const BuildOptions& options, const Threads& threads,
                       Ranks& ranks, const SinkFactory& sink, Progress& progress) {
  const Parameters& p = options.parameters;
  check(p);
  BuildSummary summary;
  Stopwatch watch(ranks);
  const int levels = level_count(p);
  const bool coarse_to_fine = p.method == Method::kCoarseToFine;
  const Lattice finest(resolution_mm(p)), coarsest(resolution_mm(p) << (levels - 1));
  // Coarse to fine, a bin is one cell of the coarsest level: it lies in one tile.
  const BinGrid grid = coarse_to_fine ? BinGrid(finest, 1 << (levels - 1)) : BinGrid(finest);

  Pager pager(paged_bytes(options.memory_bytes, threads.count()), options.spill_folder);
  const double budget_bytes = static_cast<double>(paged_bytes(options.memory_bytes, threads.count())) * ranks.size();
  double announced = 0;
  for (const PointSource* source : sources) announced += static_cast<double>(source->size());
  check_disk(options.spill_folder, announced * sizeof(BinnedPoint), budget_bytes);
  PointBins bins = PointBins::read(sources, grid, threads, ranks, pager, progress);
  std::vector<PointBins::Counts> counts{bins.counts()};
  std::vector<OccupiedBin> all = occupied_bins(bins);
  ranks.pool(counts, all);
  for (const PointBins::Counts& c : counts) {
    summary.points += c.points;
    summary.not_finite += c.not_finite;
    summary.out_of_range += c.out_of_range;
    summary.outside_box += c.outside_box;
  }
  if (summary.points == 0)
    throw Error(ErrorCode::kBadInput,
                "no point left to build from: " + std::to_string(sources.size()) + " input(s), " +
                    std::to_string(summary.not_finite) + " point(s) not finite, " +
                    std::to_string(summary.out_of_range) + " out of range",
                sources.empty() ? "" : sources[0]->name());
  const Strays strays = find_strays(all, grid);
  bins.drop(strays.bins);
  summary.points -= summary.strays = strays.points;
  std::erase_if(all, [&](const OccupiedBin& b) { return std::ranges::binary_search(strays.bins, b.id); });
  std::vector<BinId> occupied;
  for (const OccupiedBin& b : all) occupied.push_back(b.id);
  summary.extent_m = extent_of(occupied, grid);
  watch.lap("partition", summary.phases);

  const std::int32_t reach = coarse_to_fine ? kDomainRings : complete_halo(p);
  TileTable table(occupied, coarse_to_fine ? BinGrid(coarsest, 1) : grid, tile_cells(options), reach, options.max_nodes,
                  levels - 1);
  table.share_out(all, ranks.size());
  check_disk(options.spill_folder,
             working_set_bytes(p, static_cast<double>(summary.points), nodes_of(table, levels - 1)), budget_bytes);
  bins.redistribute(ranks, [&](BinId bin) { return table.owner_of(bin); });
  summary.layout = finest_layout(table, levels);
  TileSink& tiles = sink(summary.layout);
  // Rank 0 tidies up what is there when it makes its sink: nobody saves or puts anything before. Parts keep no records
  // of points, and hear from each other before they save anything else.
  if (ranks.in_step()) ranks.exchange(std::vector<Bytes>(static_cast<std::size_t>(ranks.size())));

  if (coarse_to_fine) {
    std::optional<OrderedPoints> points(std::in_place, std::move(bins), grid, table, threads, pager, progress);
    watch.lap("sort", summary.phases);
    Records records(options.memory);
    if (records.follow() && (!options.before || options.before->layout() != summary.layout))
      throw Error(ErrorCode::kFailed, "the map that is followed has another layout");
    Levels built = build_levels(
        {p, table, *points, options.trajectory, options.labels_only, options.neighbours_by_lattice, records}, threads,
        ranks, pager, progress, [&](int level) { watch.lap("level " + std::to_string(level + 1), summary.phases); });
    const PassContext context{p, built.table, threads, ranks, pager, progress, options.trajectory};
    FinalTiles finished(std::move(built.tiles), std::move(built.finished), records.follow() ? options.before : nullptr);
    if (options.layers) above_pass(context, *points, records, finished);
    points.reset();
    watch.lap("above", summary.phases);
    summary.components = built.components.all;
    summary.components_kept = built.components.kept;
    TileSet in_reach = within(built.table, built.bound, 0);
    add(in_reach, finished.overturned);
    add(built.worked_on, finished.overturned);
    summary.tiles_recomputed = count(built.worked_on);
    summary.tiles_in_reach = count(in_reach);
    if (options.layers) layer_pass(context, finished);
    watch.lap("layers", summary.phases);
    commit(context, std::move(finished), tiles, summary);
    watch.lap("commit", summary.phases);
    add_up_bytes(ranks, summary);
    return summary;
  }

  const PassContext context{p, table, threads, ranks, pager, progress, options.trajectory};
  NodeFields nodes(pager, table.tiles().size());
  context.for_each_tile("model", {writes(nodes)}, [&](std::size_t i, int) {
    nodes[i] = TileField<Node>(table.tiles()[i].box, std::max({kLinkHalo, reach, kFitHalo}));
  });
  model_pass(context, std::move(bins), grid, nodes);
  watch.lap("model", summary.phases);

  exchange_halo(table, nodes, kLinkHalo, threads, ranks);
  const ComponentCounts components = link_pass(context, nodes);
  summary.components = components.all;
  summary.components_kept = components.kept;
  watch.lap("link", summary.phases);

  exchange_halo(table, nodes, reach, threads, ranks);
  complete_pass(context, options.neighbours_by_lattice, nodes);
  watch.lap("complete", summary.phases);

  exchange_halo(table, nodes, kFitHalo, threads, ranks);
  FinalTiles finished(fit_pass(context, nodes), TileSet(table.tiles().size(), 1), nullptr);
  nodes = {};
  watch.lap("fit", summary.phases);
  if (options.layers) layer_pass(context, finished);
  watch.lap("layers", summary.phases);
  commit(context, std::move(finished), tiles, summary);
  watch.lap("commit", summary.phases);
  add_up_bytes(ranks, summary);
  return summary;
}

}  // namespace btms
