// The input of the benchmarks: a city of 10 points/m^2, 1 M points or what the environment variable BTMS_BENCH_POINTS
// says, generated once a run; and the models made from it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "engine/metrics/metrics.h"
#include "engine/model/memory_map.h"
#include "engine/scenes/scene.h"
#include "engine/terrain/segmentation.h"
#include "engine/tiling/build.h"

namespace btms::bench {

// Scene points as a source; immutable, thread-safe.
class ScenePoints final : public PointSource {
 public:
  explicit ScenePoints(const std::vector<ScenePoint>& points);
  std::string name() const override { return "scene"; }
  std::uint64_t size() const override { return points_.size(); }
  void read(std::uint64_t first, std::size_t count, PointBlock& block) const override;
  const PointBlock& all() const { return points_; }
  const std::vector<std::uint32_t>& truth() const { return truth_; }

 private:
  PointBlock points_;
  std::vector<std::uint32_t> truth_;  // SceneClass
};

inline constexpr std::uint64_t kPointBytes = 20;  // of a point in a PointBlock

std::vector<ScenePoint> generate_all(const Scene& scene);

struct City {
  std::unique_ptr<Scene> scene;
  std::unique_ptr<ScenePoints> points;
  std::filesystem::path las;  // the same points in a file
};
const City& city();

// The "city" preset at another resolution, tiles of 128 m: at the default edge of 128 cells a million points are one
// tile, which leaves a second thread nothing to do.
BuildOptions city_options(int resolution_m);

struct CityMap {
  BuildSummary summary;
  MemoryMap map;
  double points_per_node = 0;
};
// The city's model. Checked once: tiles, threads and nanoflann give the digest of one tile, one thread and the scan.
const CityMap& city_map(int resolution_m);

// oneTBB for any count, as the program does.
std::unique_ptr<Threads> make_threads(std::int64_t count);

// Labels against truth.
Confusion score_labels(const std::vector<Label>& labels, const std::vector<std::uint32_t>& truth);

}  // namespace btms::bench
