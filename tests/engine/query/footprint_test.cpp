// Whether a vehicle may be somewhere: against a search over every node.
#include "engine/query/footprint.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/query/nearest.h"
#include "engine/query/profile.h"
#include "engine/query/shape.h"
#include "tests/engine/query/query_map.h"

namespace btms {
namespace {

using test::CountingMap;
using test::rolling_map;

VehicleLimits some_limits() {
  VehicleLimits limits;
  limits.slope_deg = 30;
  limits.step_m = 0.28;
  limits.roughness_m = 0.055;
  return limits;
}

TrianglePlaces triangle_places(const Lattice& lattice, NodeId id) {
  TrianglePlaces out;
  const auto corners = triangle_corners(id.triangle);
  for (std::size_t c = 0; c < 3; ++c)
    out[c] = {(id.cell.col + corners[c].x / 2.0) * lattice.resolution_m(),
              (id.cell.row + corners[c].y / 2.0) * lattice.resolution_m()};
  return out;
}

// Whether any place of a triangle is in the shape, by many places of it; its border counts as `margin_m` thick.
template <class Inside>
bool sampled_touch(const TrianglePlaces& t, const Inside& in_shape) {
  constexpr int kSteps = 40;
  for (int a = 0; a <= kSteps; ++a)
    for (int b = 0; a + b <= kSteps; ++b) {
      const double u = double(a) / kSteps, v = double(b) / kSteps, w = 1 - u - v;
      if (in_shape(Place{u * t[0].x_m + v * t[1].x_m + w * t[2].x_m, u * t[0].y_m + v * t[1].y_m + w * t[2].y_m}))
        return true;
    }
  return false;
}

// Unsafe for sure when a place well inside is bad; safe for sure when no place near it is.
template <class Inside>
void expect_agrees(const MemoryMap& map, const CheckAnswer& answer, const Inside& inside, Place about, double reach_m) {
  const HazardRules rules(some_limits(), map.layout().lattice.resolution_mm());
  const Lattice lattice = map.layout().lattice;
  bool bad_inside = false, bad_near = false;
  const auto cell_of = [&](double m) { return static_cast<std::int32_t>(std::floor(m / lattice.resolution_m())); };
  for (std::int32_t row = cell_of(about.y_m - reach_m) - 1; row <= cell_of(about.y_m + reach_m) + 1; ++row)
    for (std::int32_t col = cell_of(about.x_m - reach_m) - 1; col <= cell_of(about.x_m + reach_m) + 1; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const NodeId id{{col, row}, t};
        const auto tile = map.load(map.layout().grid.tile_of(id.cell));
        const bool bad = !tile || rules.of(*tile, id).hazard != Hazard::kNone;
        if (!bad) continue;
        const TrianglePlaces places = triangle_places(lattice, id);
        bad_inside |= sampled_touch(places, [&](Place p) { return inside(p, -0.05); });
        bad_near |= sampled_touch(places, [&](Place p) { return inside(p, 0.05); });
      }
  if (bad_inside) EXPECT_FALSE(answer.safe) << about.x_m << " " << about.y_m;
  if (!bad_near) EXPECT_TRUE(answer.safe) << about.x_m << " " << about.y_m << " " << hazard_name(answer.hazard);
}

TEST(Footprint, DiscsAgreeWithASearch) {
  const MemoryMap map = rolling_map(3);
  const Terrain terrain(std::make_shared<CountingMap>(map));
  test::Random random(11);
  int safe = 0, unsafe = 0;
  for (int i = 0; i < 150; ++i) {
    const Place centre{double(random.between(-2000, 98000)) / 1000, double(random.between(-2000, 98000)) / 1000};
    const double radius = double(random.between(50, 2500)) / 1000;
    const CheckAnswer answer = check_disc(terrain, centre, radius, some_limits());
    ++(answer.safe ? safe : unsafe);
    expect_agrees(
        map, answer,
        [&](Place p, double more) { return std::hypot(p.x_m - centre.x_m, p.y_m - centre.y_m) <= radius + more; },
        centre, radius);
    if (!answer.safe) EXPECT_LE(std::hypot(answer.at.x_m - centre.x_m, answer.at.y_m - centre.y_m), radius + 1.5);
  }
  EXPECT_GT(safe, 10);
  EXPECT_GT(unsafe, 10);
}

TEST(Footprint, PolygonsAgreeWithASearchEitherWayRound) {
  const MemoryMap map = rolling_map(3);
  const Terrain terrain(std::make_shared<CountingMap>(map));
  test::Random random(12);
  for (int i = 0; i < 100; ++i) {
    const Place centre{double(random.between(2000, 94000)) / 1000, double(random.between(2000, 94000)) / 1000};
    const double yaw = double(random.between(0, 6283)) / 1000, ux = std::cos(yaw), uy = std::sin(yaw);
    const double half = double(random.between(200, 2000)) / 1000, width = half / 2;
    std::vector<Place> corners;
    for (const auto& [x, y] : {std::pair(half, width), {-half, width}, {-half, -width}, {half, -width}})
      corners.push_back({centre.x_m + ux * x - uy * y, centre.y_m + uy * x + ux * y});
    const CheckAnswer answer = check_polygon(terrain, corners, some_limits());
    expect_agrees(
        map, answer,
        [&](Place p, double more) {
          const double dx = p.x_m - centre.x_m, dy = p.y_m - centre.y_m;
          return std::abs(ux * dx + uy * dy) <= half + more && std::abs(ux * dy - uy * dx) <= width + more;
        },
        centre, 1.2 * half);
    std::reverse(corners.begin(), corners.end());
    EXPECT_EQ(check_polygon(terrain, corners, some_limits()).safe, answer.safe);
  }
}

// Level ground; one node is an obstacle, one too rough, and so on.
TEST(Footprint, NamesWhatIsInTheWay) {
  MapLayout layout{Lattice(1000), {8, {}}};
  auto map = std::make_shared<MemoryMap>(layout);
  TerrainTile tile(1000, {0, 0, 8, 8});
  std::fill(tile.corner_mm.begin(), tile.corner_mm.end(), 0);
  std::fill(tile.centre_mm.begin(), tile.centre_mm.end(), 0);
  for (NodeSurface& node : tile.nodes) node.state = NodeState::kObserved;
  const auto node = [&](std::int32_t col, std::int32_t row) -> NodeSurface& {
    return tile.nodes[tile.node_index({{col, row}, kEast})];
  };
  node(1, 1).state = NodeState::kObstacle;
  node(3, 1).step_mm = 250;
  node(5, 1).roughness_mm = 90;
  node(1, 4).clearance_mm = 1500;
  node(3, 4).state = NodeState::kUnknown;
  node(5, 4).step_mm = 100;
  tile.centre_mm[tile.cell_index({6, 6})] = 400;
  map->put({0, 0}, std::move(tile));
  const Terrain terrain(map);
  VehicleLimits limits;
  limits.height_m = 1.8;
  limits.roughness_m = 0.08;
  const auto at = [&](double x, double y) { return check_disc(terrain, {x, y}, 0.05, limits); };
  EXPECT_EQ(at(1.9, 1.5).hazard, Hazard::kObstacle);
  EXPECT_EQ(at(3.9, 1.5).hazard, Hazard::kStep);
  EXPECT_EQ(at(5.9, 1.5).hazard, Hazard::kRoughness);
  EXPECT_EQ(at(1.9, 4.5).hazard, Hazard::kClearance);
  EXPECT_EQ(at(3.9, 4.5).hazard, Hazard::kUnknown);
  EXPECT_EQ(at(6.9, 6.5).hazard, Hazard::kSlope);
  EXPECT_EQ(at(-3, 1).hazard, Hazard::kOutside);
  EXPECT_TRUE(at(5.9, 4.5).safe);
  EXPECT_NEAR(at(5.9, 4.5).traversability, 0.5, 1e-6);
  EXPECT_EQ(at(2.5, 2.5).traversability, 1);
  limits.unknown_is_safe = true;
  EXPECT_TRUE(at(3.9, 4.5).safe);
  EXPECT_TRUE(at(-3, 1).safe);

  limits.unknown_is_safe = false;
  const std::vector<Place> path = {{0.5, 2.5}, {3.0, 2.5}, {4.2, 1.5}, {7.5, 1.5}};
  const CheckAnswer drive = check_path(terrain, path, 0.2, limits);
  EXPECT_EQ(drive.hazard, Hazard::kStep) << "the first on the way";
  const std::vector<Place> footprint = {{0.2, 0.1}, {-0.2, 0.1}, {-0.2, -0.1}, {0.2, -0.1}};
  EXPECT_EQ(check_path(terrain, path, footprint, limits).hazard, Hazard::kStep);
  EXPECT_TRUE(check_path(terrain, std::vector<Place>{{0.5, 2.5}, {7.5, 2.5}}, footprint, limits).safe);
  EXPECT_FALSE(check_path(terrain, std::vector<Place>{{0.5, 2.5}, {NAN, 2.5}}, 0.1, limits).safe);

  const auto nearest = nearest_traversable(terrain, {1.9, 1.5}, 0.01, 5, limits);
  ASSERT_TRUE(nearest);
  EXPECT_NEAR(nearest->x_m, 2.0 + 1.0 / 6, 1e-9);
  EXPECT_NEAR(nearest->y_m, 1.5, 1e-9);
  EXPECT_FALSE(nearest_traversable(terrain, {-50, 0}, 0.1, 20, limits));
}

TEST(Footprint, NoQuestionIsTooOdd) {
  const MemoryMap map = rolling_map(2);
  const Terrain terrain(std::make_shared<CountingMap>(map));
  const VehicleLimits limits;
  EXPECT_FALSE(check_disc(terrain, {NAN, 0}, 1, limits).safe);
  EXPECT_FALSE(check_disc(terrain, {1e300, 0}, 1, limits).safe);
  EXPECT_THROW(check_disc(terrain, {0, 0}, 1e9, limits), Error);
  EXPECT_THROW(check_disc(terrain, {0, 0}, NAN, limits), Error);
  EXPECT_THROW(check_disc(terrain, {0, 0}, INFINITY, limits), Error);
  EXPECT_THROW(check_polygon(terrain, std::vector<Place>{{0, 0}, {1, 1}}, limits), Error);
  EXPECT_NO_THROW(check_polygon(terrain, std::vector<Place>{{9, 9}, {9, 9}, {9, 9}}, limits));
  EXPECT_THROW(check_path(terrain, std::vector<Place>{{0, 0}, {6e7, 0}}, 1, limits), Error);
  EXPECT_THROW(check_path(terrain, std::vector<Place>{}, 1, limits), Error);
  VehicleLimits nobody;
  nobody.slope_deg = NAN;
  EXPECT_FALSE(check_disc(terrain, {20, 20}, 1, nobody).safe);
}

TEST(Profile, PlacesOfTheLineAndEveryStepBetween) {
  const MemoryMap map = rolling_map(2);
  const Terrain terrain(std::make_shared<CountingMap>(map));
  const std::vector<Place> line = {{1, 1}, {4, 5}, {4, 9.5}};
  const auto sparse = profile(terrain, line, 0);
  ASSERT_EQ(sparse.size(), 3u);
  EXPECT_EQ(sparse[2].distance_m, 9.5);
  const auto dense = profile(terrain, line, 2);
  ASSERT_EQ(dense.size(), 7u);  // 0 2 4 5 6 8 9.5
  EXPECT_EQ(dense[1].distance_m, 2);
  EXPECT_NEAR(dense[1].place.x_m, 2.2, 1e-12);
  EXPECT_NEAR(dense[4].place.y_m, 6, 1e-12);
  for (const ProfilePoint& p : dense) EXPECT_EQ(p.height.status, terrain.height(p.place).status);
  EXPECT_THROW(profile(terrain, line, 1e-9), Error);
  EXPECT_THROW(profile(terrain, std::vector<Place>{}, 1), Error);
  EXPECT_THROW(profile(terrain, std::vector<Place>{{0, 0}, {NAN, 1}}, 1), Error);
}

}  // namespace
}  // namespace btms
