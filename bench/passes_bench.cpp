// The passes of a build, one at a time, at r = 4 m, each from the result of the one before and with the halo exchange
// that precedes it in a build.
//   BM_Partition  points in memory -> points sorted by bin        checked: every bin's points, counted from the scene
//   BM_Model      bins -> nodes (Eq 2, 3, 5)                      checked: nodes as from one thread; no point lost
//   BM_Link       candidates -> components, merged over borders   checked: nodes and component counts as from one
//   thread BM_Complete   predictions (Eq 7-11), by nanoflann or by scan  checked: nodes as from one thread and the scan
//   BM_Fit        corners, planes, tiles, digest (Eq 12-13)       checked: digest of a build in one tile
//   BM_Layers     steps and costs                                 checked: tiles as from one thread
// `copies` compares with a memcpy of the pass's input: 20 bytes a point, 8 a binned point, 24 a node of interior and
// halo.
#include <algorithm>
#include <map>
#include <optional>
#include <tuple>

#include "bench/bench_city.h"
#include "bench/measure.h"
#include "engine/tiling/finished_tiles.h"
#include "engine/tiling/passes.h"

namespace btms::bench {
namespace {

constexpr int kResolution_m = 4;

Pager& pager() {
  static Pager everything_in_memory(kUnlimited_bytes, {});
  return everything_in_memory;
}

template <class T>
Paged<T> copy_of(const Paged<T>& from) {
  Paged<T> copy(pager(), from.size());
  for (std::size_t i = 0; i < from.size(); ++i) *copy.edit(i) = *from.view(i);
  return copy;
}

PointBins partition(const BinGrid& grid, const Threads& threads) {
  const std::array<const PointSource*, 1> sources{city().points.get()};
  Progress progress;
  return PointBins::read(sources, grid, threads, *single_rank(), pager(), progress);
}

std::vector<BinId> ids_of(const PointBins& bins) {
  std::vector<BinId> ids;
  for (std::size_t k = 0; k < bins.size(); ++k) ids.push_back(bins.id(k));
  return ids;
}

// Results of every pass, from one thread and the lattice scan.
struct Stages {
  BuildOptions options = city_options(kResolution_m);
  BinGrid grid{Lattice(resolution_mm(options.parameters))};
  std::int32_t reach = complete_halo(options.parameters);
  TileTable table{ids_of(partition(grid, *serial_threads())), grid, *options.tile_cells, reach, options.max_nodes};
  NodeFields modelled, linked, completed;
  FinishedTiles finished, layered;
  ComponentCounts components;
  std::uint64_t node_bytes = 0;

  NodeFields empty_fields() const {
    NodeFields nodes(pager(), table.tiles().size());
    for (std::size_t i = 0; i < nodes.size(); ++i)
      *nodes.edit(i) = TileField<Node>(table.tiles()[i].box, std::max({kLinkHalo, reach, kFitHalo}));
    return nodes;
  }
};

// A Stages' passes on some threads.
class Runner {
 public:
  Runner(const Stages& stages, std::unique_ptr<Threads> threads) : stages_(stages), threads_(std::move(threads)) {}

  void model(PointBins&& bins, NodeFields& nodes) { model_pass(context_, std::move(bins), stages_.grid, nodes); }
  ComponentCounts link(NodeFields& nodes) {
    exchange(nodes, kLinkHalo);
    return link_pass(context_, nodes);
  }
  void complete(bool by_lattice, NodeFields& nodes) {
    exchange(nodes, stages_.reach);
    complete_pass(context_, by_lattice, nodes);
  }
  FinishedTiles fit(NodeFields& nodes) {
    exchange(nodes, kFitHalo);
    return fit_pass(context_, nodes);
  }
  void layers(FinishedTiles& tiles) {
    FinalTiles all = final_tiles(std::move(tiles));
    layer_pass(context_, all);
    tiles = std::move(all.values);
  }
  CommitSummary commit(FinishedTiles&& tiles, TileSink& sink) {
    return commit_pass(context_, final_tiles(std::move(tiles)), sink);
  }

 private:
  FinalTiles final_tiles(FinishedTiles&& tiles) const {
    return {std::move(tiles), TileSet(stages_.table.tiles().size(), 1), nullptr};
  }
  void exchange(NodeFields& nodes, std::int32_t rings) {
    exchange_halo(stages_.table, nodes, rings, *threads_, *ranks_);
  }

  const Stages& stages_;
  std::unique_ptr<Threads> threads_;
  std::unique_ptr<Ranks> ranks_ = single_rank();
  Progress progress_;
  PassContext context_{stages_.options.parameters, stages_.table, *threads_, *ranks_, pager(), progress_,
                       stages_.options.trajectory};
};

const Stages& stages() {
  static const std::unique_ptr<const Stages> made = [] {
    auto s = std::make_unique<Stages>();
    Runner runner(*s, serial_threads());
    s->modelled = s->empty_fields();
    runner.model(partition(s->grid, *serial_threads()), s->modelled);
    s->linked = copy_of(s->modelled);
    s->components = runner.link(s->linked);
    s->completed = copy_of(s->linked);
    runner.complete(true, s->completed);
    NodeFields nodes = copy_of(s->completed);
    s->finished = runner.fit(nodes);
    s->layered = copy_of(s->finished);
    runner.layers(s->layered);
    for (std::size_t i = 0; i < s->completed.size(); ++i) s->node_bytes += s->completed[i].values().size_bytes();
    return s;
  }();
  return *made;
}

// What a build in one tile, by one thread, gives after BM_Fit.
Digest fitted_digest() {
  const std::array<const PointSource*, 1> sources{city().points.get()};
  BuildOptions options = city_options(kResolution_m);
  options.tile_cells = 0;
  options.layers = false;
  MemoryMap map;
  Progress progress;
  return build_map(
             sources, options, *serial_threads(), *single_rank(),
             [&](const MapLayout& layout) -> TileSink& { return map = MemoryMap(layout); }, progress)
      .digest;
}

// Interiors only: halos are stale after a pass.
bool same_nodes(const NodeFields& a, const NodeFields& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    const CellBox& box = a[i].interior();
    for (std::int32_t row = box.row0; row < box.row1; ++row)
      if (!std::equal(a[i].cell({box.col0, row}), a[i].cell({box.col0, row}) + box.cols() * kTriangles,
                      b[i].cell({box.col0, row})))
        return false;
  }
  return true;
}

// A Measure over the city's points; the fixture of points_per_node is made before memory is looked at.
Measure measure(benchmark::State& state, std::uint64_t input_bytes) {
  const double per_node = city_map(kResolution_m).points_per_node;
  return Measure(state, city().points->size(), copy_memory(input_bytes), per_node);
}
std::string key(const char* name, const benchmark::State& state) { return name + std::to_string(state.range(0)); }

using Coordinates = std::tuple<std::int64_t, std::int64_t, std::int32_t>;

// Every bin's points, ascending, in the map frame.
std::map<BinId, std::vector<Coordinates>> expected_bins(const BinGrid& grid) {
  std::map<BinId, std::vector<Coordinates>> bins;
  const PointBlock& all = city().points->all();
  const auto index = [&](std::int64_t mm) { return static_cast<std::int32_t>(floor_div(mm, grid.edge_mm())); };
  for (std::size_t i = 0; i < all.size(); ++i)
    bins[{index(all.x_mm[i]), index(all.y_mm[i])}].emplace_back(all.x_mm[i], all.y_mm[i], all.z_mm[i]);
  for (auto& [id, points] : bins) std::sort(points.begin(), points.end());
  return bins;
}

void verify_bins(PointBins&& bins, const BinGrid& grid) {
  const auto expected = expected_bins(grid);
  verify(bins.size() == expected.size(), "number of bins");
  PointBins::Scratch scratch;
  for (std::size_t k = 0; k < bins.size(); ++k)
    bins.take(k, scratch, [&](const PointBins::Bin& bin) {
      std::vector<Coordinates> points;
      const std::int64_t west = std::int64_t{bin.id.bx} * grid.edge_mm(),
                         south = std::int64_t{bin.id.by} * grid.edge_mm();
      for (const PointBins::Run& run : bin.runs)
        for (std::uint32_t i = 0; i < run.size; ++i)
          points.emplace_back(west + run.points[i].x_mm, south + run.points[i].y_mm, run.points[i].z_mm);
      std::sort(points.begin(), points.end());
      const auto it = expected.find(bin.id);
      verify(it != expected.end() && it->second == points, "points of a bin");
    });
}

void BM_Partition(benchmark::State& state) {
  const BinGrid grid{Lattice(kResolution_m * 1000)};
  const auto threads = make_threads(state.range(0));
  verify_once(key("partition", state), [&] { verify_bins(partition(grid, *threads), grid); });
  Measure m = measure(state, city().points->size() * kPointBytes);
  for (auto _ : state) {
    std::optional<PointBins> bins;
    m.time([&] { bins.emplace(partition(grid, *threads)); });
  }
}

void BM_Model(benchmark::State& state) {
  const Stages& s = stages();
  Runner runner(s, make_threads(state.range(0)));
  verify_once(key("model", state), [&] {
    NodeFields nodes = s.empty_fields();
    runner.model(partition(s.grid, *serial_threads()), nodes);
    verify(same_nodes(nodes, s.modelled), "nodes depend on the threads");
    std::uint64_t points = 0;
    for (std::size_t i = 0; i < nodes.size(); ++i)
      for (const Node& node : nodes[i].values()) points += node.count;
    verify(points == city().points->size(), "points in nodes");
  });
  Measure m = measure(state, city().points->size() * sizeof(BinnedPoint));
  for (auto _ : state) {
    PointBins bins = partition(s.grid, *serial_threads());
    NodeFields nodes = s.empty_fields();
    m.time([&] { runner.model(std::move(bins), nodes); });
  }
}

void BM_Link(benchmark::State& state) {
  const Stages& s = stages();
  Runner runner(s, make_threads(state.range(0)));
  verify_once(key("link", state), [&] {
    NodeFields nodes = copy_of(s.modelled);
    const ComponentCounts components = runner.link(nodes);
    verify(same_nodes(nodes, s.linked), "classes depend on the threads");
    verify(components.all == s.components.all && components.kept == s.components.kept, "number of components");
  });
  Measure m = measure(state, s.node_bytes);
  for (auto _ : state) {
    NodeFields nodes = copy_of(s.modelled);
    m.time([&] { runner.link(nodes); });
  }
}

void BM_Complete(benchmark::State& state, bool by_lattice) {
  const Stages& s = stages();
  Runner runner(s, make_threads(state.range(0)));
  verify_once(key(by_lattice ? "lattice" : "nanoflann", state), [&] {
    NodeFields nodes = copy_of(s.linked);
    runner.complete(by_lattice, nodes);
    verify(same_nodes(nodes, s.completed), "predictions depend on the threads or the search");
  });
  Measure m = measure(state, s.node_bytes);
  for (auto _ : state) {
    NodeFields nodes = copy_of(s.linked);
    m.time([&] { runner.complete(by_lattice, nodes); });
  }
}

void BM_Fit(benchmark::State& state) {
  const Stages& s = stages();
  Runner runner(s, make_threads(state.range(0)));
  verify_once(key("fit", state), [&] {
    NodeFields nodes = copy_of(s.completed);
    MemoryMap map(s.table.layout());
    verify(runner.commit(runner.fit(nodes), map).digest == fitted_digest(), "digest of the tiles");
  });
  Measure m = measure(state, s.node_bytes);
  for (auto _ : state) {
    NodeFields nodes = copy_of(s.completed);
    MemoryMap map(s.table.layout());
    m.time([&] { runner.commit(runner.fit(nodes), map); });
  }
}

void BM_Layers(benchmark::State& state) {
  const Stages& s = stages();
  Runner runner(s, make_threads(state.range(0)));
  verify_once(key("layers", state), [&] {
    FinishedTiles tiles = copy_of(s.finished);
    runner.layers(tiles);
    for (std::size_t i = 0; i < tiles.size(); ++i)
      verify(tiles[i].nodes == s.layered[i].nodes, "layers depend on the threads");
  });
  Measure m = measure(state, s.node_bytes);
  for (auto _ : state) {
    FinishedTiles tiles = copy_of(s.finished);
    m.time([&] { runner.layers(tiles); });
  }
}

void on_threads(benchmark::internal::Benchmark* b) {
  b->ArgName("threads")->Arg(1)->Arg(2)->UseManualTime()->Unit(benchmark::kMillisecond);
}
BENCHMARK(BM_Partition)->Apply(on_threads);
BENCHMARK(BM_Model)->Apply(on_threads);
BENCHMARK(BM_Link)->Apply(on_threads);
BENCHMARK_CAPTURE(BM_Complete, nanoflann, false)->Apply(on_threads);
BENCHMARK_CAPTURE(BM_Complete, lattice, true)->Apply(on_threads);
BENCHMARK(BM_Fit)->Apply(on_threads);
BENCHMARK(BM_Layers)->Apply(on_threads);

}  // namespace
}  // namespace btms::bench
