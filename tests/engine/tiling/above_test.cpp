// Bridges, roofs and ceilings of whole scenes: what is terrain, and what is a further surface over it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "engine/lattice/plane.h"
#include "engine/model/memory_map.h"
#include "engine/scenes/scene.h"
#include "engine/tiling/build.h"
#include "tests/support/cloud.h"

namespace btms::test {
namespace {

struct Place {
  NodeId id;
  double x_mm, y_mm;  // from the square's centre
  std::shared_ptr<const TerrainTile> tile;
  std::size_t node;
};

// A map and the questions the tests ask of it, in metres.
class Built {
 public:
  Built(const std::vector<CloudPoint>& points, const Parameters& parameters) {
    const CloudSource source(points);
    const PointSource* sources[] = {&source};
    BuildOptions options;
    options.parameters = parameters;
    Progress progress;
    build_map(
        sources, options, *serial_threads(), *single_rank(),
        [&](const MapLayout& layout) -> TileSink& { return map_ = MemoryMap(layout); }, progress);
  }

  Place at(double x_m, double y_m) const {
    const Lattice& lattice = map_.layout().lattice;
    const auto x = static_cast<std::int64_t>(x_m * 1000), y = static_cast<std::int64_t>(y_m * 1000);
    const NodeId id = lattice.node_at(x, y);
    Place p{id, static_cast<double>(x - lattice.centre_x_mm(id.cell)),
            static_cast<double>(y - lattice.centre_y_mm(id.cell)), map_.load(map_.layout().grid.tile_of(id.cell)), 0};
    p.node = p.tile->node_index(id);
    return p;
  }
  double surface_m(double x_m, double y_m) const {
    const Place p = at(x_m, y_m);
    const FinalPlane f = FinalPlane::through(p.id.triangle, p.tile->corners_mm(p.id));
    const double r = p.tile->resolution_mm;
    return (static_cast<double>(f.centre_mm) +
            (static_cast<double>(f.rise_x_mm) * p.x_mm + static_cast<double>(f.rise_y_mm) * p.y_mm) / r) /
           1000;
  }
  const NodeSurface& node(double x_m, double y_m) const {
    const Place p = at(x_m, y_m);
    return p.tile->nodes[p.node];
  }
  // Whether a further surface of the kind lies within tolerance_m of z_m.
  bool has_upper(double x_m, double y_m, double z_m, UpperKind kind, double tolerance_m = 0.2) const {
    const Place p = at(x_m, y_m);
    for (const UpperNode& u : p.tile->upper) {
      const double z = u.z_mm + (u.slope_x * p.x_mm + u.slope_y * p.y_mm) / 8192;
      if (u.node == p.node && u.kind == kind && std::abs(z / 1000 - z_m) < tolerance_m) return true;
    }
    return false;
  }
  std::size_t uppers(double x0_m, double y0_m, double x1_m, double y1_m) const {
    std::size_t n = 0;
    for (const TileId id : map_.tiles()) {
      const auto tile = map_.load(id);
      for (const UpperNode& u : tile->upper) {
        const std::size_t cell = u.node / kTriangles, cols = static_cast<std::size_t>(tile->box.cols());
        const double x = 2 * (tile->box.col0 + static_cast<double>(cell % cols)),
                     y = 2 * (tile->box.row0 + static_cast<double>(cell / cols));
        n += x > x0_m && x < x1_m && y > y0_m && y < y1_m;
      }
    }
    return n;
  }

 private:
  MemoryMap map_;
};

// Of many places, how many passed.
struct Share {
  int all = 0, passed = 0;
  void add(bool ok) { ++all, passed += ok; }
  double percent() const { return 100.0 * passed / std::max(1, all); }
};

TEST(AboveTheSurface, TheRoadRunsOnUnderTheBridgeAndTheDeckIsASurfaceToReach) {
  using S = BridgeScene;
  const Built map(S::points(0, 0, 150'000), preset("city"));
  Share road, deck, roof, roof_ground, clear;
  for (double x = 0.5; x < 120; x += 1)
    for (double y = 0.5; y < 120; y += 1) {
      const auto x_mm = static_cast<std::int64_t>(x * 1000), y_mm = static_cast<std::int64_t>(y * 1000);
      if (S::on_deck(x_mm, y_mm)) {
        deck.add(map.has_upper(x, y, S::street_mm(x_mm) / 1000.0, UpperKind::kReachable));
        if (std::abs(x - 60) > 4) continue;
        road.add(std::abs(map.surface_m(x, y) - S::ground_mm(x_mm) / 1000.0) < 0.3);
        const double clearance_m = (S::street_mm(x_mm) - S::ground_mm(x_mm)) / 1000.0;
        clear.add(std::abs(map.node(x, y).clearance_mm / 1000.0 - clearance_m) < 0.4);
      } else if (S::on_roof(x_mm, y_mm) && S::on_roof(x_mm - 1500, y_mm - 1500) &&
                 S::on_roof(x_mm + 1500, y_mm + 1500)) {
        roof.add(map.has_upper(x, y, S::kRoof_mm / 1000.0, UpperKind::kDetached));
        roof_ground.add(std::abs(map.surface_m(x, y) - S::ground_mm(x_mm) / 1000.0) < 0.3);
      }
    }
  EXPECT_GT(road.percent(), 85) << road.all;
  EXPECT_GT(clear.percent(), 80) << clear.all;
  EXPECT_GT(deck.percent(), 80) << deck.all;
  EXPECT_GT(roof.percent(), 95) << roof.all;
  EXPECT_GT(roof_ground.percent(), 95) << roof_ground.all;
  EXPECT_EQ(map.uppers(87, 82, 120, 120), 0u) << "a wood is no surface";
  EXPECT_EQ(map.node(60.5, 20.5).clearance_mm, kNothingAbove) << "the open road";
  EXPECT_NEAR(map.node(60.5, 20.5).roughness_mm, 14, 8) << "+-25 mm, evenly";
}

TEST(AboveTheSurface, WithoutASpanWidthTheDeckStaysTerrain) {
  Parameters p = preset("city");
  p.span_width_m = 0;
  const Built map(BridgeScene::points(0, 0, 150'000), p);
  EXPECT_NEAR(map.surface_m(60.5, 60.5), 10.6, 0.2);
}

std::vector<ScenePoint> all_points(const Scene& scene) {
  std::vector<ScenePoint> made;
  for (std::size_t b = 0; b < scene.blocks(); ++b) scene.generate(b, made);
  return made;
}
std::vector<CloudPoint> cloud_of(const std::vector<ScenePoint>& made) {
  std::vector<CloudPoint> points;
  for (const ScenePoint& s : made) points.push_back({s.x_mm, s.y_mm, s.z_mm});
  return points;
}

TEST(AboveTheSurface, BridgesOfTheCity) {
  const auto scene = Scene::create({.name = "city", .points = 500'000});
  const std::vector<ScenePoint> made = all_points(*scene);
  const Built map(cloud_of(made), preset("city"));
  Share deck, roof;
  for (const ScenePoint& s : made) {
    const double x = static_cast<double>(s.x_mm) / 1000, y = static_cast<double>(s.y_mm) / 1000, z = s.z_mm / 1000.0;
    if (s.label == SceneClass::kBridgeDeck) deck.add(map.has_upper(x, y, z, UpperKind::kReachable));
    if (s.label == SceneClass::kBuilding) roof.add(map.has_upper(x, y, z, UpperKind::kDetached));
  }
  ASSERT_GT(deck.all, 3000);
  EXPECT_GT(deck.percent(), 80);
  EXPECT_GT(roof.percent(), 85);
  // The road in the cutting, where it is level from side to side.
  Share road, near;
  for (double x = 1; x < scene->width_m() - 1; x += 1)
    for (double y = 1; y < scene->height_m() - 1; y += 1) {
      if (scene->cover(x, y) != SceneClass::kBridgeDeck) continue;
      const double truth = scene->ground_z_m(x, y), e = std::abs(map.surface_m(x, y) - truth);
      near.add(e < 1);
      const double rise = std::abs(scene->ground_z_m(x + 2, y) - truth) +
                          std::abs(scene->ground_z_m(x - 2, y) - truth) +
                          std::abs(scene->ground_z_m(x, y + 2) - truth) + std::abs(scene->ground_z_m(x, y - 2) - truth);
      if (rise < 0.4 && map.node(x, y).clearance_mm > 3000) road.add(e < 0.3);
    }
  EXPECT_GT(road.percent(), 70) << road.all;
  EXPECT_GT(near.percent(), 85) << near.all;
}

TEST(AboveTheSurface, ACeilingIsDetached) {
  const auto scene = Scene::create({.name = "indoor", .points = 200'000});
  const Built map(cloud_of(all_points(*scene)), preset("city"));
  Share ceiling, reachable;
  for (double x = 1; x < scene->width_m(); x += 2)
    for (double y = 1; y < scene->height_m(); y += 2) {
      ceiling.add(map.has_upper(x, y, 3.2, UpperKind::kDetached));
      reachable.add(map.has_upper(x, y, 3.2, UpperKind::kReachable));
    }
  EXPECT_GT(ceiling.percent(), 80) << "a node with fewer than three points of it has none";
  EXPECT_EQ(reachable.passed, 0);
}

}  // namespace
}  // namespace btms::test
