// Labels of points against a small map, whatever order they come in.
#include "engine/tiling/label.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "engine/lattice/plane.h"
#include "engine/model/memory_map.h"
#include "tests/support/cloud.h"

namespace btms::test {
namespace {

constexpr std::int32_t kR_mm = 2000, kEdge = 8;
const MapLayout kLayout{Lattice(kR_mm), TileGrid{kEdge, {0, 0}}};

// A map that counts how often its tiles are asked for.
class CountingMap final : public TileSource {
 public:
  explicit CountingMap(Random& random) : map_(kLayout) {
    // Four tiles round the origin: one is missing, one holds less than its box.
    for (const TileId id : {TileId{-1, -1}, TileId{0, -1}, TileId{0, 0}}) {
      CellBox box = kLayout.grid.box_of(id);
      if (id == TileId{0, 0}) box = {box.col0, box.row0, box.col1 - 3, box.row1 - 2};
      TerrainTile tile(kR_mm, box);
      for (auto* heights : {&tile.corner_mm, &tile.centre_mm})
        for (std::int32_t& z : *heights) z = static_cast<std::int32_t>(random.between(40'000, 43'000));
      for (NodeSurface& node : tile.nodes) {
        node.state = random.between(0, 9) == 0 ? NodeState::kUnknown : NodeState::kObserved;
        node.terrain_mm = static_cast<std::uint16_t>(random.between(0, 400));
      }
      map_.put(id, std::move(tile));
    }
  }
  const MapLayout& layout() const override { return map_.layout(); }
  std::vector<TileId> tiles() const override { return map_.tiles(); }
  std::shared_ptr<const TerrainTile> load(TileId id) const override {
    ++loads;
    return map_.load(id);
  }
  const TerrainTile* find(Cell c) const {
    const auto tile = map_.load(kLayout.grid.tile_of(c));
    return tile && tile->box.contains(c) ? tile.get() : nullptr;
  }
  mutable std::atomic<int> loads = 0;

 private:
  MemoryMap map_;
};

struct Expected {
  Label label = Label::kObstacle;
  bool outside = false;
  double margin_mm = INFINITY;  // to the next threshold
};

// Eq 14 in doubles, point by point.
Expected expected(const CloudPoint& point, const CountingMap& map, const Parameters& p) {
  if (point.x_mm == PointBlock::kDroppedX) return {Label::kDropped};
  const NodeId id = kLayout.lattice.node_at(point.x_mm, point.y_mm);
  const TerrainTile* tile = map.find(id.cell);
  if (!tile || tile->nodes[tile->node_index(id)].state == NodeState::kUnknown) return {Label::kObstacle, true};
  const FinalPlane plane = FinalPlane::through(id.triangle, tile->corners_mm(id));
  const double a = static_cast<double>(plane.rise_x_mm) / kR_mm, b = static_cast<double>(plane.rise_y_mm) / kR_mm;
  const double above = point.z_mm - (static_cast<double>(plane.centre_mm) +
                                     a * static_cast<double>(point.x_mm - kLayout.lattice.centre_x_mm(id.cell)) +
                                     b * static_cast<double>(point.y_mm - kLayout.lattice.centre_y_mm(id.cell)));
  const double slope = std::sqrt(a * a + b * b), secant = std::sqrt(1 + slope * slope);
  const bool fixed = p.method == Method::kFixed;
  const double terrain = fixed ? p.terrain_distance_m * 1000 * secant : tile->nodes[tile->node_index(id)].terrain_mm;
  const double below =
      fixed ? -p.below_m * 1000 * secant : -p.level_below_m * 1000 * (1 + std::min(slope, p.label_slope_cap) / 3);
  const Label label = above < below ? Label::kBelow : above <= terrain ? Label::kTerrain : Label::kObstacle;
  return {label, false, std::min(std::abs(above - below), std::abs(above - terrain))};
}

// Runs of neighbours of many lengths, single points far from them, dropped points, points outside.
std::vector<CloudPoint> mixed_points(Random& random, std::size_t n) {
  constexpr std::int64_t kReach = kEdge * kR_mm + 3'000;
  std::vector<CloudPoint> points;
  while (points.size() < n) {
    const std::int64_t x = random.between(-kReach, kReach), y = random.between(-kReach, kReach);
    const std::int64_t run = random.between(1, 30), stray = random.between(0, 49);
    if (stray == 0) points.push_back({std::int64_t{1} << 35, -(std::int64_t{1} << 34), 0});
    if (stray < 5) points.push_back({PointBlock::kDroppedX, 0, 0});
    for (std::int64_t i = 0; i < run; ++i)
      points.push_back({x + random.between(-1500, 1500), y + random.between(-1500, 1500),
                        static_cast<std::int32_t>(random.between(34'000, 44'500))});
  }
  return points;
}

void check_labels(const Parameters& parameters, std::size_t n, bool strays) {
  Random random(n);
  const CountingMap map(random);
  std::vector<CloudPoint> points = mixed_points(random, n);
  if (!strays) std::erase_if(points, [](const CloudPoint& p) { return std::abs(p.x_mm / 2) > 1'000'000; });
  const CloudSource source(points);
  for (const std::size_t cache_bytes : {kLabelCacheBytes, std::size_t{1}}) {
    map.loads = 0;
    std::vector<Label> labels(points.size());
    Progress progress;
    const LabelCounts counts = label_points(
        source, map, parameters, *serial_threads(),
        [&](std::uint64_t first, std::span<const Label> run, PointBlock&) {
          std::copy(run.begin(), run.end(), labels.begin() + static_cast<std::ptrdiff_t>(first));
        },
        progress, cache_bytes);
    LabelCounts sums;
    std::size_t close = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Expected want = expected(points[i], map, parameters);
      close += want.margin_mm < 0.1;  // floats may round the other way
      if (want.margin_mm >= 0.1) {
        EXPECT_EQ(labels[i], want.label) << "point " << i;
      }
      sums.outside += want.outside;
      sums.terrain += labels[i] == Label::kTerrain;
      sums.obstacle += labels[i] == Label::kObstacle;
      sums.below += labels[i] == Label::kBelow;
      sums.dropped += labels[i] == Label::kDropped;
    }
    EXPECT_LT(close * 100, points.size());
    EXPECT_EQ(counts.terrain, sums.terrain);
    EXPECT_EQ(counts.obstacle, sums.obstacle);
    EXPECT_EQ(counts.below, sums.below);
    EXPECT_EQ(counts.dropped, sums.dropped);
    EXPECT_EQ(counts.outside, sums.outside);
    EXPECT_GT(std::min({sums.terrain, sums.obstacle, sums.below, sums.outside}), 0u);
    if (cache_bytes == 1)
      EXPECT_GT(map.loads, 100) << "nothing is kept but the tile in use";
    else
      EXPECT_LE(map.loads, 17) << "a tile, or a place without one, is asked for once";
  }
}

TEST(LabelPoints, AreWhatTheirNodesSay) {
  for (const char* name : {"city", "paper-single-scan"}) {
    SCOPED_TRACE(name);
    check_labels(preset(name), 100'003, true);  // several blocks; the last one ends in no whole lane
    check_labels(preset(name), 5'001, false);   // near enough for division by multiplication
  }
}

}  // namespace
}  // namespace btms::test
