#include "bench/bench_city.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>

#include "bench/measure.h"
#include "io/points/las_writer.h"

namespace btms::bench {
namespace {

std::uint64_t wanted_points() {
  const char* text = std::getenv("BTMS_BENCH_POINTS");
  if (text == nullptr) return 1'000'000;
  char* end = nullptr;
  const std::uint64_t points = std::strtoull(text, &end, 10);
  verify(*end == 0 && points >= 10'000, "BTMS_BENCH_POINTS is a whole number of at least 10000");
  return points;
}

City make_city() {
  City made;
  SceneOptions options;
  options.points = wanted_points();
  made.scene = Scene::create(options);
  const std::vector<ScenePoint> points = generate_all(*made.scene);
  made.points = std::make_unique<ScenePoints>(points);
  made.las = folder() / "city.las";
  std::vector<LasPoint> records;
  records.reserve(points.size());
  for (const ScenePoint& p : points) records.push_back({p.x_mm, p.y_mm, p.z_mm, static_cast<std::uint8_t>(p.label), 0});
  const auto writer = LasWriter::create(made.las);
  writer->append(records);
  writer->commit();
  return made;
}

std::unique_ptr<CityMap> make_map(int resolution_m) {
  auto made = std::make_unique<CityMap>();
  const std::array<const PointSource*, 1> sources{city().points.get()};
  const auto ranks = single_rank();
  Progress progress;
  BuildOptions options = city_options(resolution_m);
  const auto sink = [&](const MapLayout& layout) -> TileSink& { return made->map = MemoryMap(layout); };
  options.tile_cells = 0;
  options.neighbours_by_lattice = true;
  const Digest simple = build_map(sources, options, *serial_threads(), *ranks, sink, progress).digest;
  made->summary = build_map(sources, city_options(resolution_m), *make_threads(2), *ranks, sink, progress);
  verify(made->summary.digest == simple, "the digest depends on tiles, threads or neighbour search");

  std::uint64_t nodes = 0;
  for (const TileId id : made->map.tiles())
    for (const NodeSurface& node : made->map.load(id)->nodes) nodes += node.count > 0;
  made->points_per_node = static_cast<double>(made->summary.points) / static_cast<double>(nodes);
  return made;
}

}  // namespace

ScenePoints::ScenePoints(const std::vector<ScenePoint>& points) {
  points_.reset(points.size());
  truth_.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points_.x_mm[i] = points[i].x_mm;
    points_.y_mm[i] = points[i].y_mm;
    points_.z_mm[i] = points[i].z_mm;
    truth_.push_back(static_cast<std::uint32_t>(points[i].label));
  }
}

void ScenePoints::read(std::uint64_t first, std::size_t count, PointBlock& block) const {
  block.reset(count);
  const auto at = static_cast<std::ptrdiff_t>(first);
  std::copy_n(points_.x_mm.begin() + at, count, block.x_mm.begin());
  std::copy_n(points_.y_mm.begin() + at, count, block.y_mm.begin());
  std::copy_n(points_.z_mm.begin() + at, count, block.z_mm.begin());
}

std::vector<ScenePoint> generate_all(const Scene& scene) {
  std::vector<ScenePoint> points;
  for (std::size_t i = 0; i < scene.blocks(); ++i) scene.generate(i, points);
  return points;
}

const City& city() {
  static const City made = make_city();
  return made;
}

BuildOptions city_options(int resolution_m) {
  BuildOptions options;
  options.parameters = preset("city");
  options.parameters.method = Method::kFixed;
  options.parameters.resolution_m = resolution_m;
  options.tile_cells = 128 / resolution_m;
  return options;
}

const CityMap& city_map(int resolution_m) {
  static std::map<int, std::unique_ptr<CityMap>> maps;
  auto& map = maps[resolution_m];
  if (!map) map = make_map(resolution_m);
  return *map;
}

std::unique_ptr<Threads> make_threads(std::int64_t count) { return tbb_threads(static_cast<int>(count)); }

Confusion score_labels(const std::vector<Label>& labels, const std::vector<std::uint32_t>& truth) {
  std::vector<std::uint8_t> terrain;
  terrain.reserve(labels.size());
  for (const Label label : labels) terrain.push_back(label == Label::kTerrain);
  return score(truth, terrain, {}, asprs_rules()).without;
}

}  // namespace btms::bench
