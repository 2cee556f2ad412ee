// The map after it was built (r = 4 m): on disk and back, its fingerprint, its heights.
//   BM_WriteMap  all tiles into a new map folder, fsynced and published  checked: the digest of what is read back
//   BM_LoadMap   open, and decode every tile                             checked: the digest of the tiles
//   BM_Digest    XXH3 over every node of the map in memory               checked: the digest the build summed up
//   BM_Surface   the height at 100 k scattered places; "points" are queries
//                checked: 80 % of the heights over open ground lie within 0.25 m of the scene's exact surface
// Points are the points the map was built from. `copies` compares with copying the map's files and fsync (write),
// reading them (load), or a memcpy of the decoded tiles (digest).
#include <cmath>

#include "bench/bench_city.h"
#include "bench/measure.h"
#include "engine/model/surface.h"
#include "io/store/map_store.h"

namespace btms::bench {
namespace {

namespace fs = std::filesystem;

constexpr int kResolution_m = 4;

void write_map(const fs::path& path, const Threads& threads) {
  const CityMap& built = city_map(kResolution_m);
  const auto writer = MapWriter::create(path, built.map.layout());
  const std::vector<TileId> ids = built.map.tiles();
  threads.for_each(ids.size(), [&](std::size_t i, int) { writer->put(ids[i], TerrainTile(*built.map.load(ids[i]))); });
  MapInfo info;
  info.parameters = city_options(kResolution_m).parameters;
  info.digest = built.summary.digest;
  writer->publish(info, {writer->finish()});
}

Digest digest_of(const TileSource& map, const Threads& threads) {
  const std::vector<TileId> ids = map.tiles();
  std::vector<Digest> digests(ids.size());
  threads.for_each(ids.size(), [&](std::size_t i, int) { digests[i] = digest(*map.load(ids[i])); });
  Digest sum;
  for (const Digest& d : digests) sum += d;
  return sum;
}

const fs::path& stored_map() {
  static const fs::path path = [] {
    const fs::path made = folder() / "stored.btms";
    write_map(made, *serial_threads());
    return made;
  }();
  return path;
}

// Every file of the map, one after another.
template <class Time>
double sum_over_files(Time&& time) {
  double seconds = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(stored_map()))
    if (entry.is_regular_file()) seconds += time(entry.path());
  return seconds;
}

void BM_WriteMap(benchmark::State& state) {
  const CityMap& built = city_map(kResolution_m);
  const auto threads = make_threads(state.range(0));
  const fs::path path = folder() / "written.btms";
  verify_once("write" + std::to_string(state.range(0)), [&] {
    write_map(path, *threads);
    verify(digest_of(*MapReader::open(path), *serial_threads()) == built.summary.digest, "digest of a written map");
  });
  Measure m(state, built.summary.points, sum_over_files(copy_file), built.points_per_node);
  for (auto _ : state) {
    fs::remove_all(path);
    m.time([&] { write_map(path, *threads); });
  }
  fs::remove_all(path);
}

void BM_LoadMap(benchmark::State& state) {
  const CityMap& built = city_map(kResolution_m);
  const auto threads = make_threads(state.range(0));
  verify_once("load" + std::to_string(state.range(0)), [&] {
    verify(digest_of(*MapReader::open(stored_map()), *threads) == built.summary.digest, "digest of a loaded map");
  });
  Measure m(state, built.summary.points, sum_over_files(read_file), built.points_per_node);
  for (auto _ : state)
    m.time([&] {
      const auto reader = MapReader::open(stored_map());
      const std::vector<TileId> ids = reader->tiles();
      threads->for_each(ids.size(), [&](std::size_t i, int) { benchmark::DoNotOptimize(reader->load(ids[i])); });
    });
}

void BM_Digest(benchmark::State& state) {
  const CityMap& built = city_map(kResolution_m);
  const auto threads = make_threads(state.range(0));
  verify_once("digest" + std::to_string(state.range(0)),
              [&] { verify(digest_of(built.map, *threads) == built.summary.digest, "digest of the map"); });
  std::uint64_t bytes = 0;
  for (const TileId id : built.map.tiles()) {
    const auto tile = built.map.load(id);
    bytes += 4 * (tile->corner_mm.size() + tile->centre_mm.size()) + sizeof(NodeSurface) * tile->nodes.size();
  }
  Measure m(state, built.summary.points, copy_memory(bytes), built.points_per_node);
  for (auto _ : state) m.time([&] { benchmark::DoNotOptimize(digest_of(built.map, *threads)); });
}

struct Place {
  double x_m, y_m;
};

// Low-discrepancy, so that no cache line is met in order.
std::vector<Place> places() {
  std::vector<Place> made;
  const Scene& scene = *city().scene;
  for (int i = 1; i <= 100'000; ++i)
    made.push_back({std::fmod(i * 0.7548776662466927, 1.0) * scene.width_m(),
                    std::fmod(i * 0.5698402909980532, 1.0) * scene.height_m()});
  return made;
}

void verify_heights(const TileSource& map) {
  const Scene& scene = *city().scene;
  std::size_t open = 0, near = 0;
  for (const Place& p : places()) {
    if (scene.cover(p.x_m, p.y_m) != SceneClass::kGround) continue;
    ++open;
    const SurfacePoint s = surface_at(map, p.x_m, p.y_m);
    near += s.state != NodeState::kUnknown && std::abs(s.z_m - scene.ground_z_m(p.x_m, p.y_m)) < 0.25;
  }
  const auto share = static_cast<double>(near) / static_cast<double>(open);
  verify(share > 0.8, "heights over open ground, near the truth: " + std::to_string(share));
}

void BM_Surface(benchmark::State& state) {
  const CityMap& built = city_map(kResolution_m);
  verify_once("surface", [&] { verify_heights(built.map); });
  const std::vector<Place> asked = places();
  Measure m(state, asked.size(), 0, built.points_per_node);
  for (auto _ : state)
    m.time([&] {
      for (const Place& p : asked) benchmark::DoNotOptimize(surface_at(built.map, p.x_m, p.y_m));
    });
}

void on_threads(benchmark::internal::Benchmark* b) {
  b->ArgName("threads")->Arg(1)->Arg(2)->UseManualTime()->Unit(benchmark::kMillisecond);
}
BENCHMARK(BM_WriteMap)->Apply(on_threads);
BENCHMARK(BM_LoadMap)->Apply(on_threads);
BENCHMARK(BM_Digest)->Apply(on_threads);
BENCHMARK(BM_Surface)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace btms::bench
