#include "engine/tiling/forecast.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <ctime>
#include <map>
#include <set>

#include "engine/error.h"
#include "engine/tiling/block_source.h"
#include "engine/tiling/level_passes.h"
#include "engine/tiling/memory_budget.h"
#include "engine/tiling/passes.h"
#include "engine/tiling/tile_table.h"

namespace btms {
namespace {

constexpr std::uint64_t kSampleRuns = 8192, kRunPoints = 256;      // long runs spare a disk its seeks
constexpr std::uint64_t kGoldenShift = 0x9e3779b97f4a7c15u >> 20;  // runs must not keep step with the lines of a scan
// Where a square of the survey has as many on average, few that hold points are missed.
constexpr std::uint64_t kEnoughRuns = 4, kEnoughPoints = 8;
constexpr std::int32_t kWidestSquare = 1024;      // cells
constexpr std::uint64_t kTrialPoints = 400'000;   // about
constexpr std::uint64_t kTrialReads = 8'000'000;  // at most, to find them

// What a build costs, measured on the synthetic city and on airborne surveys (docs/performance.md). The first two only
// matter by their ratio: a trial tells how fast the machine is.
struct Costs {
  double point_ns, node_ns;
  double resident_node_bytes;                // of the working set's, what can't be parked
  double spilled_of_all, spilled_of_excess;  // bytes written under a memory limit: what doesn't fit, pass after pass
};
constexpr Costs kCoarseToFineCosts{350, 660, 15, 0.7, 1.4}, kFixedCosts{22, 1250, 4, 0, 1.1};
constexpr double kWorker_bytes = 5e6;                      // of a thread, under a memory limit
constexpr double kShardBytes = 27e3, kMapBytes = 37e3;     // of a shard, and of the whole, before the first node
constexpr double kFilledShare = 0.25;                      // of the bytes of another node
constexpr double kProgramBytes = 23e6, kPublish_s = 0.01;  // of any build
constexpr double kSerialShare = 0.09;                      // of the time: what a second thread doesn't help

bool coarse_to_fine(const Parameters& p) { return p.method == Method::kCoarseToFine; }

const Costs& costs_of(const Parameters& p) { return coarse_to_fine(p) ? kCoarseToFineCosts : kFixedCosts; }

std::uint64_t whole(double v) { return static_cast<std::uint64_t>(std::llround(v)); }

// Several sources as one sequence of points.
class Sequence {
 public:
  explicit Sequence(std::span<const PointSource* const> sources) : sources_(sources) {
    for (const PointSource* source : sources) size_ += source->size();
  }
  std::uint64_t size() const { return size_; }

  // Calls visit(block) for the points from `first` on, at most `count`, block by block.
  template <class Visit>
  void read(std::uint64_t first, std::uint64_t count, PointBlock& block, Visit&& visit) const {
    constexpr std::uint64_t kBlock = 1 << 16;
    for (const PointSource* source : sources_) {
      for (; count > 0 && first < source->size();) {
        const std::uint64_t n = std::min({kBlock, count, source->size() - first});
        source->read(first, static_cast<std::size_t>(n), block);
        visit(block);
        first += n;
        count -= n;
      }
      first -= std::min(first, source->size());
      if (count == 0) return;
    }
  }

 private:
  std::span<const PointSource* const> sources_;
  std::uint64_t size_ = 0;
};

// A sampled point: its cell, and which run it came with.
struct Sampled {
  BinId cell;
  std::uint32_t run;
};

struct Square {
  BinId id;
  std::uint64_t points;
};

// Squares of `edge` cells that hold sampled points, ascending, and how often a run met one.
struct Squares {
  std::vector<Square> all;
  std::uint64_t meetings = 0;

  Squares(const std::vector<Sampled>& sample, std::int32_t edge) {
    std::vector<BinId> ids;
    ids.reserve(sample.size());
    const int shift = std::countr_zero(static_cast<std::uint32_t>(edge));
    for (std::size_t i = 0; i < sample.size(); ++i) {
      ids.push_back({sample[i].cell.bx >> shift, sample[i].cell.by >> shift});
      meetings += i == 0 || sample[i].run != sample[i - 1].run || ids[i] != ids[i - 1];
    }
    std::sort(ids.begin(), ids.end());
    for (const BinId& id : ids) {
      if (all.empty() || all.back().id != id) all.push_back({id, 0});
      ++all.back().points;
    }
  }
};

// Bins of `cells` cells that hold points, as far as squares of `edge` cells tell.
std::vector<BinId> bins_of(const std::vector<Square>& squares, std::int32_t edge, std::int32_t cells) {
  std::set<BinId> bins;
  for (const auto& [id, points] : squares) {
    const std::int32_t wide = std::max(1, edge / cells);
    const auto first = [&](std::int32_t b) {
      return static_cast<std::int32_t>(floor_div(std::int64_t{b} * edge, cells));
    };
    for (std::int32_t y = 0; y < wide; ++y)
      for (std::int32_t x = 0; x < wide; ++x) bins.insert({first(id.bx) + x, first(id.by) + y});
  }
  return {bins.begin(), bins.end()};
}

std::uint64_t within_rings(const std::vector<BinId>& cells, std::int32_t rings) {
  std::set<BinId> near;
  for (const BinId& c : cells)
    for (std::int32_t y = -rings; y <= rings; ++y)
      for (std::int32_t x = -rings; x <= rings; ++x) near.insert({c.bx + x, c.by + y});
  return near.size();
}

void add_point(PointBlock& all, const PointBlock& from, std::size_t i) {
  all.x_mm.push_back(from.x_mm[i]);
  all.y_mm.push_back(from.y_mm[i]);
  all.z_mm.push_back(from.z_mm[i]);
}

}  // namespace

PointSurvey survey_points(std::span<const PointSource* const> sources, const BuildOptions& options) {
  const Parameters& p = options.parameters;
  check(p);
  const bool levelled = coarse_to_fine(p);
  const int levels = level_count(p);
  const std::int32_t r_mm = resolution_mm(p);
  const Sequence inputs(sources);

  // A run somewhere in every equal part of the inputs; all points of small inputs, each a run of its own.
  const bool everything = inputs.size() <= kSampleRuns * kRunPoints;
  const std::uint64_t runs = everything ? 1 : kSampleRuns, part = inputs.size() / runs;
  std::vector<Sampled> sample;
  std::uint64_t read = 0;
  std::uint32_t number = 0;
  PointBlock block;
  for (std::uint64_t i = 0; i < runs; ++i) {
    const std::uint64_t shift = everything ? 0 : i * kGoldenShift % (part - kRunPoints + 1);
    inputs.read(part * i + shift, everything ? part : kRunPoints, block, [&](const PointBlock& some) {
      read += some.size();
      for (std::size_t k = 0; k < some.size(); ++k)
        if (some.x_mm[k] != PointBlock::kDroppedX)
          sample.push_back({{static_cast<std::int32_t>(floor_div(some.x_mm[k], r_mm)),
                             static_cast<std::int32_t>(floor_div(some.y_mm[k], r_mm))},
                            everything ? number++ : number});
    });
    ++number;
  }
  if (sample.empty())
    throw Error(ErrorCode::kBadInput, "no point left to build from", sources.empty() ? "" : sources[0]->name());

  PointSurvey survey;
  const double share = static_cast<double>(sample.size()) / static_cast<double>(read);
  survey.points = whole(share * static_cast<double>(inputs.size()));
  // Squares as small as the sample can tell empty ones from unseen ones.
  std::int32_t edge = 1;
  Squares squares(sample, edge);
  while (edge < kWidestSquare && squares.meetings < (everything ? kEnoughPoints : kEnoughRuns) * squares.all.size())
    squares = Squares(sample, edge *= 2);
  const double square_m2 = std::pow(edge * r_mm / 1000.0, 2), nodes_in_square = 4.0 * edge * edge;
  survey.area_m2 = square_m2 * static_cast<double>(squares.all.size());
  const double times = static_cast<double>(survey.points) / static_cast<double>(sample.size());
  double with_points = 0;
  for (const Square& square : squares.all)
    with_points += nodes_in_square * (1 - std::exp(-static_cast<double>(square.points) * times / nodes_in_square));
  survey.nodes_with_points = whole(with_points);

  const Lattice finest(r_mm), coarsest(r_mm << (levels - 1));
  const BinGrid grid = levelled ? BinGrid(coarsest, 1) : BinGrid(finest);
  const std::vector<BinId> bins = bins_of(squares.all, edge, levelled ? 1 << (levels - 1) : grid.edge_cells);
  const std::int32_t reach = levelled ? kDomainRings : complete_halo(p);
  const TileTable table(bins, grid, tile_cells(options), reach, options.max_nodes, levels - 1);
  std::set<TileId> tiles;
  const auto add_tiles = [&](BinId square, std::int32_t cells) {
    const CellBox box{square.bx * cells, square.by * cells, (square.bx + 1) * cells, (square.by + 1) * cells};
    table.layout().grid.for_each_tile(box.grown(reach), [&](TileId id) { tiles.insert(id); });
  };
  if (levelled)
    for (const BinId& bin : bins) add_tiles(bin, 1);
  else
    for (const Square& square : squares.all) add_tiles(square.id, edge);
  survey.tiles = tiles.size();
  survey.nodes = levelled ? within_rings(bins, kDomainRings) * kTriangles << (2 * (levels - 1))
                          : whole(nodes_in_square * static_cast<double>(squares.all.size()));
  return survey;
}

Trial try_build(std::span<const PointSource* const> sources, const PointSurvey& survey, const BuildOptions& options,
                const SinkFactory& sink) {
  const Parameters& p = options.parameters;
  const Sequence inputs(sources);
  const std::int64_t cell_mm = std::int64_t{resolution_mm(p)} << (level_count(p) - 1);
  const double edge_m = std::sqrt(static_cast<double>(kTrialPoints) / survey.density_per_m2());
  const std::int64_t cells = std::max<std::int64_t>(2, std::llround(edge_m * 1000 / static_cast<double>(cell_mm)));

  // The fullest square of whole cells, among points from the middle of the inputs; all of small inputs.
  const std::uint64_t count = std::min(kTrialReads, inputs.size()), first = (inputs.size() - count) / 2;
  const bool everything = inputs.size() <= kTrialPoints;
  const auto square_of = [&](const PointBlock& some, std::size_t i) {
    return BinId{static_cast<std::int32_t>(floor_div(some.x_mm[i], cells * cell_mm)),
                 static_cast<std::int32_t>(floor_div(some.y_mm[i], cells * cell_mm))};
  };
  PointBlock block;
  std::map<BinId, std::uint64_t> found;
  inputs.read(first, count, block, [&](const PointBlock& some) {
    for (std::size_t i = 0; i < some.size(); ++i)
      if (some.x_mm[i] != PointBlock::kDroppedX) ++found[square_of(some, i)];
  });
  const auto fullest =
      std::max_element(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  PointBlock part_points;
  inputs.read(first, count, block, [&](const PointBlock& some) {
    for (std::size_t i = 0; i < some.size(); ++i)
      if (some.x_mm[i] != PointBlock::kDroppedX && (everything || square_of(some, i) == fullest->first))
        add_point(part_points, some, i);
  });
  if (part_points.size() == 0)
    throw Error(ErrorCode::kBadInput, "no finite point in the middle of the inputs: no forecast can be made");

  const std::clock_t begun = std::clock();
  Trial trial;
  const BlockSource part(part_points, "a part of the inputs");
  const PointSource* const source = &part;
  Progress progress;
  trial.summary = build_map({&source, 1}, options, *serial_threads(), *single_rank(), sink, progress);
  trial.cpu_s = static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;
  return trial;
}

Forecast forecast_build(const PointSurvey& survey, const Trial& trial, std::uint64_t trial_map_bytes,
                        const BuildOptions& options, int threads) {
  const Costs& costs = costs_of(options.parameters);
  const auto cost_s = [&](std::uint64_t points, std::uint64_t nodes) {
    return 1e-9 * (costs.point_ns * static_cast<double>(points) + costs.node_ns * static_cast<double>(nodes));
  };
  const double points = static_cast<double>(survey.points), nodes = static_cast<double>(survey.nodes);
  const double slowness = trial.cpu_s / cost_s(trial.summary.points, trial.summary.nodes);

  Forecast f;
  f.seconds =
      kPublish_s + slowness * cost_s(survey.points, survey.nodes) * (kSerialShare + (1 - kSerialShare) / threads);
  // A filled node compresses well.
  const auto stored_nodes = [](double all, double filled) { return all - filled + kFilledShare * filled; };
  const BuildSummary& t = trial.summary;
  const double trial_nodes = stored_nodes(static_cast<double>(t.nodes), static_cast<double>(t.filled));
  const double trial_files = kShardBytes * static_cast<double>(t.tiles);
  const double node_map_bytes = std::max(0.0, static_cast<double>(trial_map_bytes) - trial_files) / trial_nodes;
  const double filled =
      coarse_to_fine(options.parameters) ? std::max(0.0, nodes - static_cast<double>(survey.nodes_with_points)) : 0;
  f.map_bytes =
      whole(kMapBytes + kShardBytes * static_cast<double>(survey.tiles) + node_map_bytes * stored_nodes(nodes, filled));
  const double held = working_set_bytes(options.parameters, points, nodes);
  const double resident = costs.resident_node_bytes * nodes, paged = held - resident;
  const double budget = static_cast<double>(paged_bytes(options.memory_bytes, threads));
  f.memory_bytes = whole(kProgramBytes + held);
  if (paged > budget) {
    f.memory_bytes = whole(kProgramBytes + kWorker_bytes * threads + budget + resident);
    f.spill_bytes = whole(costs.spilled_of_all * paged + costs.spilled_of_excess * (paged - budget));
  }
  return f;
}

}  // namespace btms
