#include "tests/invariance/invariance.h"

#include <gtest/gtest.h>

#include <memory>

#include "engine/tiling/build.h"
#include "engine/tiling/label.h"

namespace btms::test {
namespace {

std::vector<std::unique_ptr<CloudSource>> arrange(const std::vector<CloudPoint>& points, const std::string& how) {
  std::vector<CloudPoint> p = points;
  if (how == "shuffled") {
    Random random(99);
    for (std::size_t i = p.size(); i > 1; --i)
      std::swap(p[i - 1], p[static_cast<std::size_t>(random.between(0, static_cast<std::int64_t>(i) - 1))]);
  }
  if (how == "reversed") std::reverse(p.begin(), p.end());
  std::vector<std::unique_ptr<CloudSource>> sources;
  if (how == "split") {  // in three files of unlike sizes, the last first
    const auto a = static_cast<std::ptrdiff_t>(p.size() / 7), b = static_cast<std::ptrdiff_t>(p.size() / 2);
    sources.push_back(std::make_unique<CloudSource>(std::vector<CloudPoint>(p.begin() + b, p.end())));
    sources.push_back(std::make_unique<CloudSource>(std::vector<CloudPoint>(p.begin(), p.begin() + a)));
    sources.push_back(std::make_unique<CloudSource>(std::vector<CloudPoint>(p.begin() + a, p.begin() + b)));
  } else {
    sources.push_back(std::make_unique<CloudSource>(std::move(p)));
  }
  return sources;
}

// Order-dependent fingerprint of a label sequence.
std::string label_digest(const MemoryMap& map, const std::vector<CloudPoint>& points, const Parameters& p,
                         const Threads& threads) {
  std::vector<Label> labels(points.size());
  Progress progress;
  label_points(
      CloudSource(points), map, p, threads,
      [&](std::uint64_t first, std::span<const Label> run, PointBlock&) {
        std::copy(run.begin(), run.end(), labels.begin() + static_cast<std::ptrdiff_t>(first));
      },
      progress);
  std::uint64_t h = 1469598103934665603u;
  for (const Label l : labels) h = (h ^ static_cast<std::uint64_t>(l)) * 1099511628211u;
  return std::to_string(h);
}

// Drops tiles: ranks can't hand them over, their digest travels in the summary.
class NoSink final : public TileSink {
 public:
  Digest put(TileId, TerrainTile&& tile) override { return digest(tile); }
};

}  // namespace

std::vector<Way> all_ways(const std::vector<std::int32_t>& tile_cells) {
  // Ranks are forked: before any thread of TBB exists.
  std::vector<Way> ways;
  for (const std::int32_t cells : tile_cells) {
    for (const char* inputs : {"as is", "shuffled", "split", "reversed"}) {
      ways.push_back({cells, "ranks:2", inputs});
      ways.push_back({cells, "ranks:3", inputs});
      ways.push_back({cells, "telling:3", inputs});
    }
#ifndef __SANITIZE_THREAD__                         // it knows nothing of threads that begin after a fork
    ways.push_back({cells, "ranks:2x2", "split"});  // two threads in each rank
#endif
    ways.push_back({cells, "ranks:2", "shuffled", false, true});
  }
  for (const std::int32_t cells : tile_cells) {
    for (const char* inputs : {"as is", "shuffled", "split", "reversed"})
      for (const char* executor : {"serial", "tbb:1", "tbb:2"}) ways.push_back({cells, executor, inputs});
    ways.push_back({cells, "serial", "as is", true});
    ways.push_back({cells, "tbb:2", "shuffled", false, true});
  }
  return ways;
}

MemoryMap build_plain(const std::vector<CloudPoint>& points, const Parameters& parameters, std::int32_t tile_cells) {
  const CloudSource source(points);
  const PointSource* sources[] = {&source};
  BuildOptions options;
  options.parameters = parameters;
  options.tile_cells = tile_cells;
  Progress progress;
  MemoryMap map;
  build_map(
      sources, options, *serial_threads(), *single_rank(),
      [&](const MapLayout& layout) -> TileSink& { return map = MemoryMap(layout); }, progress);
  return map;
}

namespace {

// As the parts of a job array do.
class TellingRanks final : public Ranks {
 public:
  explicit TellingRanks(Ranks& ranks) : ranks_(ranks) {}
  int rank() const override { return ranks_.rank(); }
  int size() const override { return ranks_.size(); }
  bool tells_all(std::uint64_t) const override { return true; }

 private:
  std::vector<Bytes> do_exchange(std::vector<Bytes> out) override { return ranks_.exchange(std::move(out)); }
  Ranks& ranks_;
};

}  // namespace

std::string fingerprint(const std::vector<CloudPoint>& points, const Parameters& parameters, const Way& way) {
  const auto owned = arrange(points, way.inputs);
  std::vector<const PointSource*> sources;
  for (const auto& s : owned) sources.push_back(s.get());
  BuildOptions options;
  options.parameters = parameters;
  options.tile_cells = way.tile_cells;
  options.neighbours_by_lattice = way.lattice;
  if (way.parked) options.memory_bytes = 0;
  Progress progress;

  const std::size_t colon = way.executor.find(':');
  const std::string kind = way.executor.substr(0, colon);
  const int n = colon == std::string::npos ? 1 : std::stoi(way.executor.substr(colon + 1));
  if (kind == "ranks" || kind == "telling") {
    std::string digest;
    run_forked_ranks(n, [&](Ranks& forked) {
      TellingRanks telling(forked);
      Ranks& ranks = kind == "telling" ? telling : forked;
      NoSink sink;
      const std::size_t times = way.executor.find('x');
      const auto threads =
          times == std::string::npos ? serial_threads() : tbb_threads(std::stoi(way.executor.substr(times + 1)));
      const BuildSummary s = build_map(
          sources, options, *threads, ranks, [&](const MapLayout&) -> TileSink& { return sink; }, progress);
      digest = s.digest.hex();
    });
    return digest;
  }
  const auto threads = kind == "tbb" ? tbb_threads(n) : serial_threads();
  const auto ranks = single_rank();
  MemoryMap map;
  const BuildSummary s = build_map(
      sources, options, *threads, *ranks, [&](const MapLayout& layout) -> TileSink& { return map = MemoryMap(layout); },
      progress);
  return s.digest.hex() + ' ' + label_digest(map, points, parameters, *threads);
}

void expect_one_digest(const std::vector<CloudPoint>& points, const Parameters& parameters,
                       const std::vector<Way>& ways) {
  const std::string plain = fingerprint(points, parameters, {0, "serial", "as is", true});
  ASSERT_GT(plain.size(), 32u);
  for (const Way& way : ways) {
    const std::string got = fingerprint(points, parameters, way);
    ASSERT_GE(got.size(), 32u);
    EXPECT_EQ(got, plain.substr(0, got.size()))
        << "tile edge " << way.tile_cells << ", " << way.executor << ", inputs " << way.inputs
        << (way.lattice ? ", lattice scan" : ", nanoflann") << (way.parked ? ", parked" : "");
  }
}

}  // namespace btms::test
