// The two jobs of the program, files to files, at r = 2, 4 and 8 m.
//   BM_BuildMap   LAS file -> map folder, fsynced and published
//                 checked: the digest of what is read back, against a build in one tile, one thread and the lattice
//                 scan
//   BM_LabelFile  LAS file and map folder -> classified LAS file, fsynced
//                 checked: the counts against the classes in the file; F1 against the scene's truth (counter f1)
// `copies` compares with copying the LAS file and fsync, by one thread.
#include <algorithm>
#include <array>
#include <map>

#include "bench/bench_city.h"
#include "bench/measure.h"
#include "engine/tiling/label.h"
#include "io/points/point_file.h"
#include "io/store/map_store.h"

namespace btms::bench {
namespace {

namespace fs = std::filesystem;

// Tells a working label from a broken one; how good the labels are is not a benchmark's question.
constexpr double kLeastF1 = 0.8;

void build(const fs::path& path, int resolution_m, const Threads& threads) {
  const auto file = open_points(city().las);
  const std::array<const PointSource*, 1> sources{file.get()};
  Progress progress;
  std::unique_ptr<MapWriter> writer;
  const auto sink = [&](const MapLayout& layout) -> TileSink& {
    writer = MapWriter::create(path, layout);
    return *writer;
  };
  const BuildOptions options = city_options(resolution_m);
  const BuildSummary summary = build_map(sources, options, threads, *single_rank(), sink, progress);
  MapInfo info;
  info.parameters = options.parameters;
  info.digest = summary.digest;
  info.points = summary.points;
  writer->publish(info, {writer->finish()});
}

Digest stored_digest(const fs::path& path) {
  const auto reader = MapReader::open(path);
  Digest sum;
  for (const TileId id : reader->tiles()) sum += digest(*reader->load(id));
  return sum;
}

const fs::path& stored_map(int resolution_m) {
  static std::map<int, fs::path> maps;
  fs::path& path = maps[resolution_m];
  if (path.empty()) {
    path = folder() / ("built" + std::to_string(resolution_m) + ".btms");
    build(path, resolution_m, *make_threads(2));
  }
  return path;
}

LabelCounts label(const fs::path& map, const fs::path& to, const Threads& threads) {
  const auto reader = MapReader::open(map);
  const auto file = open_points(city().las);
  const auto writer = create_labels(*file, to);
  Progress progress;
  const LabelCounts counts = label_points(
      *file, *reader, reader->info().parameters, threads,
      [&](std::uint64_t first, std::span<const Label> labels, PointBlock& block) {
        writer->write(first, labels, block);
      },
      progress);
  writer->commit();
  return counts;
}

// Returns F1 against the scene's truth.
double verify_labelled(const fs::path& file, const LabelCounts& counts) {
  const std::vector<std::uint32_t> classes = read_classes(file);
  std::vector<Label> labels;
  for (const std::uint32_t c : classes)
    labels.push_back(c == 2 ? Label::kTerrain : c == 7 ? Label::kBelow : Label::kObstacle);
  const auto found = [&](Label l) { return static_cast<std::uint64_t>(std::count(labels.begin(), labels.end(), l)); };
  verify(labels.size() == city().points->size() && found(Label::kTerrain) == counts.terrain &&
             found(Label::kBelow) == counts.below && found(Label::kObstacle) == counts.obstacle && counts.dropped == 0,
         "counts of labels");
  const double f1 = score_labels(labels, city().points->truth()).f1();
  verify(f1 > kLeastF1, "F1 of the labels: " + std::to_string(f1));
  return f1;
}

std::string key(const char* name, const benchmark::State& state) {
  return name + std::to_string(state.range(0)) + "/" + std::to_string(state.range(1));
}

void BM_BuildMap(benchmark::State& state) {
  const auto r = static_cast<int>(state.range(0));
  const CityMap& reference = city_map(r);
  const auto threads = make_threads(state.range(1));
  const fs::path path = folder() / "timed.btms";
  verify_once(key("build", state), [&] {
    build(path, r, *threads);
    verify(stored_digest(path) == reference.summary.digest, "digest of the built map");
  });
  Measure m(state, reference.summary.points, copy_file(city().las), reference.points_per_node);
  for (auto _ : state) {
    fs::remove_all(path);
    m.time([&] { build(path, r, *threads); });
  }
  fs::remove_all(path);
}

void BM_LabelFile(benchmark::State& state) {
  const auto r = static_cast<int>(state.range(0));
  const CityMap& reference = city_map(r);
  const fs::path& map = stored_map(r);
  const auto threads = make_threads(state.range(1));
  const fs::path to = folder() / "labelled";
  static std::map<int, double> f1;
  verify_once(key("label", state), [&] {
    const LabelCounts counts = label(map, to, *threads);
    f1[r] = verify_labelled(to / city().las.filename(), counts);
  });
  Measure m(state, reference.summary.points, copy_file(city().las), reference.points_per_node);
  for (auto _ : state) {
    fs::remove_all(to);
    m.time([&] { label(map, to, *threads); });
  }
  fs::remove_all(to);
  state.counters["f1"] = f1[r];
}

void on_cells_and_threads(benchmark::internal::Benchmark* b) {
  b->ArgNames({"r", "threads"})->ArgsProduct({{2, 4, 8}, {1, 2}})->UseManualTime()->Unit(benchmark::kMillisecond);
}
BENCHMARK(BM_BuildMap)->Apply(on_cells_and_threads);
BENCHMARK(BM_LabelFile)->Apply(on_cells_and_threads);

}  // namespace
}  // namespace btms::bench
