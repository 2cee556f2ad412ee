// Single scans, model and labels in memory; a scan is segmented by one thread, several scans run at a time.
//   BM_SegmentScans/simulated  four scans of a drive through the city, 64 beams of 2048 rays
//   BM_SegmentScans/kitti      SemanticKITTI's full scans, where the environment variable BTMS_DATA names a folder with
//   them
// From floats in memory to labels, by ScanSegmenter, whose memory is warm. Checked: labels as by a map of the scan, and
// F1 against truth. `copies` compares with a memcpy of the points (20 bytes each).
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>

#include "bench/bench_city.h"
#include "bench/measure.h"
#include "engine/scenes/drive.h"
#include "engine/tiling/scan_segmenter.h"
#include "engine/tiling/segment.h"
#include "io/points/point_file.h"

namespace btms::bench {
namespace {

namespace fs = std::filesystem;

// Tells a working segmentation from a broken one.
constexpr double kLeastF1 = 0.8;

struct Scan {
  std::unique_ptr<PointSource> points;
  std::vector<std::uint32_t> truth;
};

struct Scans {
  std::vector<Scan> scans;
  TruthRules rules;
  std::uint64_t points() const {
    std::uint64_t sum = 0;
    for (const Scan& scan : scans) sum += scan.points->size();
    return sum;
  }
};

// A file's points, without the file.
std::vector<ScenePoint> points_in(const PointSource& file) {
  PointBlock block;
  file.read(0, static_cast<std::size_t>(file.size()), block);
  verify(block.dropped() == 0, "points dropped from " + file.name());
  std::vector<ScenePoint> points;
  for (std::size_t i = 0; i < block.size(); ++i)
    points.push_back({block.x_mm[i], block.y_mm[i], block.z_mm[i], SceneClass::kUnclassified});
  return points;
}

const Scans& simulated() {
  static const Scans made = [] {
    SceneOptions scene;
    scene.points = 2'000'000;
    DriveOptions options;
    options.scans = 4;
    options.azimuths = 2048;
    options.step_m = 80;
    const Drive drive(scene, options);
    Scans scans{{}, semantic_kitti_rules()};
    scans.rules.sensor_height_m = 0;  // the ambiguous classes left out
    for (std::size_t i = 0; i < options.scans; ++i) {
      std::vector<std::vector<DrivePoint>> scan(1);
      drive.scan(i, i + 1, scan);
      std::vector<ScenePoint> points;
      std::vector<std::uint32_t> truth;
      for (const DrivePoint& p : scan[0]) {
        const auto mm = [](float m) { return std::llround(static_cast<double>(m) * 1000); };
        points.push_back({mm(p.x_m), mm(p.y_m), static_cast<std::int32_t>(mm(p.z_m)), SceneClass::kUnclassified});
        truth.push_back(p.label);
      }
      scans.scans.push_back({std::make_unique<ScenePoints>(points), std::move(truth)});
    }
    return scans;
  }();
  return made;
}

std::optional<fs::path> kitti_folder() {
  const char* data = std::getenv("BTMS_DATA");
  if (data == nullptr) return {};
  const fs::path path = fs::path(data) / "semantickitti" / "full_scans";
  return fs::is_directory(path / "velodyne") ? std::optional(path) : std::nullopt;
}

const Scans& kitti() {
  static const Scans made = [] {
    const fs::path path = *kitti_folder();
    Scans scans{{}, semantic_kitti_rules()};
    scans.rules.sensor_height_m = 0;  // the ambiguous classes left out
    for (const fs::directory_entry& entry : fs::directory_iterator(path / "velodyne")) {
      if (entry.path().extension() != ".bin") continue;
      const auto file = open_points(entry.path());
      scans.scans.push_back({std::make_unique<ScenePoints>(points_in(*file)),
                             read_classes(path / "labels" / entry.path().filename().replace_extension(".label"))});
    }
    verify(!scans.scans.empty(), "no scans in " + path.string());
    return scans;
  }();
  return made;
}

// The scans as a sensor delivers them: float metres, x, y, z and one more value a point.
std::vector<std::vector<float>> floats_of(const Scans& scans) {
  std::vector<std::vector<float>> all;
  PointBlock block;
  for (const Scan& scan : scans.scans) {
    scan.points->read(0, static_cast<std::size_t>(scan.points->size()), block);
    std::vector<float>& floats = all.emplace_back();
    for (std::size_t i = 0; i < block.size(); ++i)
      for (const double mm : {static_cast<double>(block.x_mm[i]), static_cast<double>(block.y_mm[i]),
                              static_cast<double>(block.z_mm[i]), 0.0})
        floats.push_back(static_cast<float>(mm / 1000));
  }
  return all;
}

// Segmenters that keep their memory, one a thread.
class Sensor {
 public:
  Sensor(const Scans& scans, const Threads& threads) : floats_(floats_of(scans)), threads_(threads) {
    for (int i = 0; i < threads.count(); ++i) segmenters_.emplace_back(preset("paper-single-scan"));
  }
  // Calls with(scan, labels) for each, from several threads.
  template <class With>
  void segment_all(const With& with) {
    threads_.for_each(floats_.size(), [&](std::size_t i, int worker) {
      ScanSegmenter& segmenter = segmenters_[static_cast<std::size_t>(worker)];
      with(i, segmenter.segment(interleaved(floats_[i].data(), floats_[i].size() / 4, 4)));
    });
  }

 private:
  std::vector<std::vector<float>> floats_;
  const Threads& threads_;
  std::vector<ScanSegmenter> segmenters_;
};

// Every scan the way of maps.
std::vector<SegmentedScan> maps_of(const Scans& scans) {
  std::vector<SegmentedScan> maps;
  for (const Scan& scan : scans.scans) maps.push_back(segment_scan(*scan.points, preset("paper-single-scan")));
  return maps;
}

// Returns F1 over all scans.
double verify_results(const Scans& scans, const std::vector<SegmentedScan>& maps, Sensor& sensor) {
  std::vector<std::vector<Label>> labels(maps.size());
  sensor.segment_all([&](std::size_t i, std::span<const Label> l) { labels[i].assign(l.begin(), l.end()); });
  Confusion all;
  for (std::size_t i = 0; i < maps.size(); ++i) {
    verify(labels[i] == maps[i].labels, "labels of a scan");
    std::vector<std::uint8_t> is_terrain;
    for (const Label label : labels[i]) is_terrain.push_back(label == Label::kTerrain);
    all += score(scans.scans[i].truth, is_terrain, {}, scans.rules).without;
  }
  verify(all.f1() > kLeastF1, "F1 of the scans: " + std::to_string(all.f1()));
  return all.f1();
}

void BM_SegmentScans(benchmark::State& state, const Scans& (*make)()) {
  const Scans& scans = make();
  const auto threads = make_threads(state.range(0));
  const std::vector<SegmentedScan> maps = maps_of(scans);
  Sensor sensor(scans, *threads);
  static std::map<bool, double> f1;
  verify_once((make == kitti ? "kitti" : "simulated") + std::to_string(state.range(0)),
              [&] { f1[make == kitti] = verify_results(scans, maps, sensor); });
  std::uint64_t nodes = 0;
  for (const SegmentedScan& s : maps)
    for (const TileId id : s.map.tiles())
      for (const NodeSurface& node : s.map.load(id)->nodes) nodes += node.count > 0;
  Measure m(state, scans.points(), copy_memory(scans.points() * kPointBytes),
            static_cast<double>(scans.points()) / static_cast<double>(nodes));
  double seconds = 0;
  for (auto _ : state) seconds += m.time([&] { sensor.segment_all([](std::size_t, std::span<const Label>) {}); });
  state.counters["f1"] = f1[make == kitti];
  state.counters["scans_per_s"] =
      static_cast<double>(scans.scans.size()) * static_cast<double>(state.iterations()) / seconds;
}

void on_threads(benchmark::internal::Benchmark* b) {
  b->ArgName("threads")->Arg(1)->Arg(2)->UseManualTime()->Unit(benchmark::kMillisecond);
}
BENCHMARK_CAPTURE(BM_SegmentScans, simulated, simulated)->Apply(on_threads);

[[maybe_unused]] const bool kitti_registered = [] {
  if (kitti_folder())
    on_threads(
        benchmark::RegisterBenchmark("BM_SegmentScans/kitti", [](benchmark::State& s) { BM_SegmentScans(s, kitti); }));
  return true;
}();

}  // namespace
}  // namespace btms::bench
