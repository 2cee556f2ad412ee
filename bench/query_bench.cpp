// What planners ask, of the city's map on disk (r = 2 m), in tiles that are in the cache; "points" are queries.
//   BM_Height      the height at 100 k scattered places, one call each, by 1 or 2 threads at once
//   BM_Heights     the same places in one call: scattered, or row by row through a window
//   BM_CheckDisc   discs of 1 or 2 m at those places (2 m are as much work as 1 m in a map of 1 m)
//                  checked: against polygons inside and around the disc
//   BM_CheckPose   footprints of a car, turned
//   BM_CheckPath   a car along 100 m; queries are paths
//   BM_Profile     heights each metre of those 100 m; queries are points
//   BM_TileGraph   the traversability graph of a tile, from tiles in the cache; points are nodes
//   BM_Route       the way across the city, in graphs that are in the cache: the line alone (0), and with the vehicle's
//                  width free along it (1); points are nodes settled
//   BM_ColdTile    a height in a tile that is not in the cache: read, decompressed, checked
//   BM_ReadShard   the shards behind those tiles, read and decoded by 1 or 2 threads at once: by their index, or, as
//                  files of older programs have none, by HDF5. Runs in turns; `hdf5` is the time of the latter in units
//                  of the former. Queries are shards         checked: the hash of all values
//   BM_Overview    the coarsest tile of a map of so many shards, elevation and class, nothing in the cache: out of the
//                  overviews. `decoded` is the time without them, estimated from that of a level 2 tile, in units of
//                  this one; queries are shards       checked: against the tiles below, on the coarsest level and one
//                  more
// Heights are checked against those of the map in memory.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <map>
#include <thread>

#include "bench/bench_city.h"
#include "bench/measure.h"
#include "engine/query/footprint.h"
#include "engine/query/profile.h"
#include "engine/routing/route.h"
#include "io/export/raster.h"
#include "io/store/manifest.h"
#include "io/store/map_folder.h"
#include "io/store/open_terrain.h"
#include "io/store/shard_assembly.h"
#include "io/store/shard_file.h"

namespace btms::bench {
namespace {

namespace fs = std::filesystem;

constexpr double kPi = 3.14159265358979323846;

constexpr int kResolution_m = 2;

const fs::path& stored_map() {
  static const fs::path path = [] {
    const CityMap& built = city_map(kResolution_m);
    const fs::path made = folder() / "queried.btms";
    const auto writer = MapWriter::create(made, built.map.layout());
    for (const TileId id : built.map.tiles()) writer->put(id, TerrainTile(*built.map.load(id)));
    MapInfo info;
    info.parameters = city_options(kResolution_m).parameters;
    info.digest = built.summary.digest;
    writer->publish(info, {writer->finish()});
    return made;
  }();
  return path;
}

// Low-discrepancy, so that no cache line is met in order.
std::vector<Place> scattered() {
  std::vector<Place> made;
  const Scene& scene = *city().scene;
  for (int i = 1; i <= 100'000; ++i)
    made.push_back({std::fmod(i * 0.7548776662466927, 1.0) * scene.width_m(),
                    std::fmod(i * 0.5698402909980532, 1.0) * scene.height_m()});
  return made;
}

std::vector<Place> window() {
  std::vector<Place> made;
  const Scene& scene = *city().scene;
  for (int row = 0; row < 250; ++row)
    for (int col = 0; col < 400; ++col)
      made.push_back({scene.width_m() * (0.2 + col / 800.0), scene.height_m() * (0.2 + row / 500.0)});
  return made;
}

// The map on disk with all its tiles in the cache, once its heights are known to be right.
const Terrain& warm() {
  static const Terrain terrain = [] {
    const Terrain opened = open_terrain(stored_map()).terrain;
    const std::vector<Place> places = scattered();
    std::vector<HeightAnswer> answers(places.size());
    opened.heights(places, answers);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const SurfacePoint s = surface_at(city_map(kResolution_m).map, places[i].x_m, places[i].y_m);
      const bool known = s.state != NodeState::kUnknown;
      verify(answers[i].state == s.state && (!known || answers[i].z_m == s.z_m), "heights are the map's");
      verify(!known || opened.height(places[i]).z_m == s.z_m, "one by one, too");
    }
    return opened;
  }();
  return terrain;
}

void BM_Height(benchmark::State& state) {
  const Terrain& terrain = warm();
  const std::vector<Place> places = scattered();
  const auto all = [&] {
    for (const Place p : places) benchmark::DoNotOptimize(terrain.height(p));
  };
  Measure m(state, places.size() * static_cast<std::uint64_t>(state.range(0)), 0);
  for (auto _ : state)
    m.time([&] {
      std::vector<std::thread> others;
      for (std::int64_t t = 1; t < state.range(0); ++t) others.emplace_back(all);
      all();
      for (std::thread& t : others) t.join();
    });
}

void BM_Heights(benchmark::State& state, std::vector<Place> (*where)()) {
  const Terrain& terrain = warm();
  const std::vector<Place> places = where();
  std::vector<HeightAnswer> answers(places.size());
  Measure m(state, places.size(), 0);
  for (auto _ : state)
    m.time([&] {
      terrain.heights(places, answers);
      benchmark::ClobberMemory();
    });
}

std::vector<Place> circle(Place centre, double radius_m) {
  std::vector<Place> polygon;
  for (int i = 0; i < 64; ++i)
    polygon.push_back({centre.x_m + radius_m * std::cos(i * kPi / 32), centre.y_m + radius_m * std::sin(i * kPi / 32)});
  return polygon;
}

void verify_discs(const Terrain& terrain, const std::vector<Place>& places, double radius_m,
                  const VehicleLimits& limits) {
  std::size_t safe = 0;
  for (std::size_t i = 0; i < places.size(); i += 10) {
    const CheckAnswer disc = check_disc(terrain, places[i], radius_m, limits);
    const CheckAnswer inside = check_polygon(terrain, circle(places[i], radius_m - 0.001), limits);
    const CheckAnswer around = check_polygon(terrain, circle(places[i], 1.004 * radius_m), limits);
    verify(inside.traversability >= disc.traversability && disc.traversability >= around.traversability &&
               inside.safe >= disc.safe && disc.safe >= around.safe,
           "a disc is between the polygons inside and around it");
    safe += disc.safe;
  }
  const double share = 10 * static_cast<double>(safe) / static_cast<double>(places.size());
  verify(share > 0.05 && share < 0.95, "some discs are safe, some not: " + std::to_string(share));
}

// Checks end at the first hazard, so these limits are never exceeded, and obstacles are left out.
VehicleLimits no_limits() {
  VehicleLimits limits;
  limits.slope_deg = 90;
  limits.step_m = 1000;
  limits.height_m = 0;
  limits.unknown_is_safe = true;
  return limits;
}

const std::vector<Place> kCar = {{-1, -0.9}, {3.2, -0.9}, {3.2, 0.9}, {-1, 0.9}};

std::vector<Place> free_places() {
  std::vector<Place> places = scattered();
  std::erase_if(places, [](Place p) { return !check_disc(warm(), p, 4, no_limits()).safe; });
  verify(places.size() > 10'000, "a tenth of the city is free");
  return places;
}

// 100 m without an obstacle.
std::vector<Place> street() {
  for (const Place from : scattered()) {
    const std::vector<Place> way = {from, {from.x_m + 80, from.y_m + 60}};
    const bool inside = way[1].x_m < city().scene->width_m() && way[1].y_m < city().scene->height_m();
    if (inside && check_path(warm(), way, kCar, no_limits()).safe) return way;
  }
  verify(false, "there is a way of 100 m");
  return {};
}

void BM_CheckDisc(benchmark::State& state) {
  const auto radius_m = static_cast<double>(state.range(0));
  const Terrain& terrain = warm();
  const std::vector<Place> places = free_places();
  const VehicleLimits limits = no_limits();
  verify_once("disc" + std::to_string(state.range(0)),
              [&] { verify_discs(terrain, scattered(), radius_m, limits_of(city_options(kResolution_m).parameters)); });
  Measure m(state, places.size(), 0);
  for (auto _ : state)
    m.time([&] {
      for (const Place p : places) benchmark::DoNotOptimize(check_disc(terrain, p, radius_m, limits));
    });
}

void BM_CheckPose(benchmark::State& state) {
  const Terrain& terrain = warm();
  const std::vector<Place> places = free_places();
  const VehicleLimits limits = no_limits();
  Measure m(state, places.size(), 0);
  for (auto _ : state)
    m.time([&] {
      for (std::size_t i = 0; i < places.size(); ++i)
        benchmark::DoNotOptimize(check_pose(terrain, {places[i], 0.001 * static_cast<double>(i)}, kCar, limits));
    });
}

void BM_CheckPath(benchmark::State& state) {
  const Terrain& terrain = warm();
  const std::vector<Place> way = street();
  const VehicleLimits limits = no_limits();
  Measure m(state, 1, 0);
  for (auto _ : state) m.time([&] { benchmark::DoNotOptimize(check_path(terrain, way, kCar, limits)); });
}

void BM_Profile(benchmark::State& state) {
  const Terrain& terrain = warm();
  const std::vector<Place> line = street();
  verify(profile(terrain, line, 1).size() == 101, "a point a metre");
  Measure m(state, 101, 0);
  for (auto _ : state) m.time([&] { benchmark::DoNotOptimize(profile(terrain, line, 1)); });
}

void BM_TileGraph(benchmark::State& state) {
  const Terrain& terrain = warm();
  const Parameters parameters = city_options(kResolution_m).parameters;
  const std::vector<TileId> ids = terrain.tiles().tiles();
  std::size_t nodes = 0;
  for (const TileId id : ids) nodes += 4 * terrain.layout().grid.box_of(id).cells();
  Measure m(state, nodes, 0);
  for (auto _ : state)
    m.time([&] {
      const TraversalGraph graph(terrain, parameters);
      for (const TileId id : ids) benchmark::DoNotOptimize(graph.tile(id));
    });
}

void BM_Route(benchmark::State& state) {
  const Terrain& terrain = warm();
  const Parameters parameters = city_options(kResolution_m).parameters;
  const TraversalGraph graph(terrain, parameters);
  RouteRules rules;
  rules.limits = limits_of(parameters);
  if (state.range(0) != 0) rules.width_m = parameters.vehicle_width_m;
  // The longest of some.
  Route longest;
  const std::vector<Place> places = scattered();
  for (std::size_t i = 0; i < 64; i += 2) {
    Route route = find_route(graph, places[i], places[i + 1], rules);
    if (route.length_m > longest.length_m) longest = std::move(route);
  }
  verify(longest.points.size() > 2, "there is a way");
  std::vector<Place> way;
  for (const RoutePoint& p : longest.points) way.push_back(p.place);
  verify(check_path(terrain, way, rules.width_m / 2, rules.limits).safe, "nothing is in the vehicle's way");
  const Place from = way.front(), to = way.back();
  Measure m(state, find_route(graph, from, to, rules).settled, 0);
  for (auto _ : state) m.time([&] { benchmark::DoNotOptimize(find_route(graph, from, to, rules)); });
  state.counters["length_m"] = longest.length_m;
}

void BM_ColdTile(benchmark::State& state) {
  warm();
  const Terrain cold = open_terrain(stored_map(), {.cache_bytes = 1}).terrain;
  const std::vector<TileId> ids = cold.tiles().tiles();
  Measure m(state, ids.size(), 0);
  for (auto _ : state)
    m.time([&] {
      for (const TileId id : ids) {
        const CellBox box = cold.layout().grid.box_of(id);
        benchmark::DoNotOptimize(cold.height({box.col0 * 2.0 + 1, box.row0 * 2.0 + 1}));
      }
    });
  verify(cold.tiles().counts().loads == ids.size() * state.iterations(), "every tile was read every time");
}

// The same shard as an older program would have written it: without the index behind what HDF5 knows.
std::span<const std::uint8_t> without_index(std::span<const std::uint8_t> file) {
  std::uint64_t hdf5_bytes = 0;
  std::memcpy(&hdf5_bytes, file.data() + 28, sizeof hdf5_bytes);  // "end of file" of an HDF5 superblock
  return file.first(hdf5_bytes);
}

void read_shards(const Manifest& manifest, bool indexed) {
  for (const ShardEntry& shard : manifest.shards) {
    const std::vector<std::uint8_t> file = read_shard(stored_map(), shard);
    const StoredShard stored{indexed ? file : without_index(file), manifest.info.layout.lattice.resolution_mm(),
                             shard.bounds()};
    benchmark::DoNotOptimize(decode_shard(stored, shard.values_xxh3));
  }
}

// Each thread reads all of them.
double seconds_of_shards(const Manifest& manifest, bool indexed, std::int64_t threads) {
  const auto begun = std::chrono::steady_clock::now();
  std::vector<std::thread> others;
  for (std::int64_t t = 1; t < threads; ++t) others.emplace_back([&] { read_shards(manifest, indexed); });
  read_shards(manifest, indexed);
  for (std::thread& t : others) t.join();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

void BM_ReadShard(benchmark::State& state) {
  warm();
  const Manifest manifest = read_manifest(stored_map());
  std::vector<double> ratios;
  Measure m(state, manifest.shards.size() * static_cast<std::uint64_t>(state.range(0)), 0);
  for (auto _ : state) {
    const double hdf5_s = seconds_of_shards(manifest, false, state.range(0));
    ratios.push_back(hdf5_s / m.time([&] { seconds_of_shards(manifest, true, state.range(0)); }));
  }
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  state.counters["hdf5"] = *middle;
}

// A tile of the city again and again.
const fs::path& wide_map(std::int32_t across) {
  static std::map<std::int32_t, fs::path> made;
  if (made.contains(across)) return made[across];
  constexpr std::int32_t kEdge = 64;
  const fs::path path = folder() / ("wide" + std::to_string(across) + ".btms");
  const CityMap& built = city_map(kResolution_m);
  std::shared_ptr<const TerrainTile> city;
  for (const TileId id : built.map.tiles())
    if (const auto tile = built.map.load(id); tile->box.cols() >= kEdge && tile->box.rows() >= kEdge) city = tile;
  TerrainTile piece = cut(*city, {city->box.col0, city->box.row0, city->box.col0 + kEdge, city->box.row0 + kEdge});
  const MapLayout layout{built.map.layout().lattice, {kEdge, {}}};
  const auto writer = MapWriter::create(path, layout);
  for (std::int32_t ty = 0; ty < across; ++ty)
    for (std::int32_t tx = 0; tx < across; ++tx) {
      piece.box = layout.grid.box_of({tx, ty});
      writer->put({tx, ty}, TerrainTile(piece));
    }
  MapInfo info;
  info.parameters = city_options(kResolution_m).parameters;
  writer->publish(info, {writer->finish()});
  return made[across] = path;
}

bool same_bits(const Window& a, const Window& b) {
  for (std::size_t l = 0; l < a.values.size(); ++l)
    if (std::memcmp(a.values[l].data(), b.values[l].data(), a.values[l].size() * sizeof(float)) != 0) return false;
  return a.values.size() == b.values.size();
}

void BM_Overview(benchmark::State& state) {
  const auto across = static_cast<std::int32_t>(state.range(0));
  const auto map = MapReader::open(wide_map(across));
  const RasterLayer* layers[] = {find_raster_layer("elevation"), find_raster_layer("class")};
  int top = 2;
  while ((across * 64 >> top) > 2 * 128) ++top;
  const CellBox served{0, 0, 128, 128};
  verify_once("overview" + std::to_string(across), [&] {
    const CellBox part{0, 0, 16, 16};
    for (const int level : {3, top})
      verify(same_bits(cut_window(*map, level, part, layers), cut_window(*map, *map, level, part, layers)),
             "an overview is what the tiles say");
  });
  const auto shards = static_cast<std::uint64_t>(std::min(across, 2 << top)) * std::min(across, 2 << top);
  Measure m(state, shards, 0);
  double seconds = 0;
  for (auto _ : state)
    seconds += m.time([&] { benchmark::DoNotOptimize(cut_window(*map, *map, top, served, layers)); });
  const auto begun = std::chrono::steady_clock::now();
  benchmark::DoNotOptimize(cut_window(*map, 2, served, layers));  // 8 x 8 shards
  const double decoded_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count() / 64 *
                           static_cast<double>(shards);
  state.counters["decoded"] = decoded_s / (seconds / static_cast<double>(state.iterations()));
}

BENCHMARK(BM_Height)->ArgName("threads")->Arg(1)->Arg(2)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Heights, scattered, scattered)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Heights, window, window)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(BM_CheckDisc)->ArgName("radius")->Arg(1)->Arg(2)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(BM_CheckPose)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(BM_CheckPath)->UseManualTime()->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_Profile)->UseManualTime()->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_TileGraph)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Route)->ArgName("width")->Arg(0)->Arg(1)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(BM_ColdTile)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Overview)->ArgName("across")->Arg(32)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(BM_ReadShard)->ArgName("threads")->Arg(1)->Arg(2)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace btms::bench
