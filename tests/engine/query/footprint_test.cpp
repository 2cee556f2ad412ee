// Footprints against every triangle of a map, one by one.
#include "engine/query/footprint.h"

#include <gtest/gtest.h>

#include <numbers>

#include "engine/error.h"
#include "engine/model/traversability.h"
#include "tests/engine/query/hazard_map.h"
#include "tests/engine/query/plane_shapes.h"

namespace btms::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Parameters car(Random& random) {
  Parameters p;
  p.resolution_m = 2;
  p.vehicle_max_slope_deg = static_cast<double>(random.between(3, 40));
  p.vehicle_max_step_m = static_cast<double>(random.between(20, 400)) / 1000;
  p.vehicle_height_m = static_cast<double>(random.between(400, 3000)) / 1000;
  return p;
}

// More than the shapes here reach.
CellBox around(PlaceMm at) {
  const Cell cell = Lattice(2000).cell_at(at.x, at.y);
  return {cell.col - 4, cell.row - 4, cell.col + 5, cell.row + 5};
}

// What the map's own vehicle says of every triangle the shape meets.
struct Costs {
  int worst = 0;
  NodeId first;  // by rows, that is not traversable
  bool first_is_there = false;
  bool safe() const { return worst != kNotTraversable; }
};
template <class Meets>
Costs costs_under(const MemoryMap& map, PlaceMm about, const Parameters& p, const Meets& meets) {
  const Vehicle vehicle(p);
  const Lattice lattice(2000);
  const CellBox box = around(about);
  Costs costs;
  for (std::int32_t row = box.row0; row < box.row1; ++row)
    for (std::int32_t col = box.col0; col < box.col1; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const NodeId id{{col, row}, t};
        if (!meets(triangle(t, {lattice.centre_x_mm(id.cell), lattice.centre_y_mm(id.cell)}, 1000))) continue;
        const auto tile = map.load(map.layout().grid.tile_of(id.cell));
        const bool there = tile && tile->box.contains(id.cell);
        const int cost =
            !there ? kNotTraversable
                   : vehicle.cost(tile->nodes[tile->node_index(id)], FinalPlane::through(t, tile->corners_mm(id)));
        if (cost == kNotTraversable && costs.safe()) {
          costs.first = id;
          costs.first_is_there = there;
        }
        costs.worst = std::max(costs.worst, cost);
      }
  return costs;
}

void expect_worst(const CheckAnswer& answer, const Costs& costs) {
  ASSERT_EQ(answer.safe, costs.safe()) << hazard_name(answer.hazard);
  if (answer.safe) {
    ASSERT_EQ(static_cast<int>(254 * (1 - answer.traversability) + 0.5), costs.worst);
  }
}
void expect_as_costs(const CheckAnswer& answer, const Costs& costs) {
  expect_worst(answer, costs);
  if (answer.safe) return;
  ASSERT_EQ(answer.traversability, 0);
  ASSERT_EQ(answer.hazard == Hazard::kOutside, !costs.first_is_there);
  const PlaceMm bad = to_mm(answer.at);
  ASSERT_EQ(Lattice(2000).node_at(bad.x, bad.y), costs.first);
}

TEST(Footprint, DiscsAreTheCostsOfTheTrianglesUnderThem) {
  const auto map = hazard_map(16);
  const Terrain terrain(map);
  Random random(5);
  int safe = 0;
  for (int round = 0; round < 3000; ++round) {
    const PlaceMm at{random.between(-3000, 99000), random.between(-3000, 99000)};
    const std::int64_t reach = random.between(0, round % 8 == 0 ? 6000 : 1500);
    const Parameters p = car(random);
    const CheckAnswer answer = check_disc(terrain, {static_cast<double>(at.x) / 1000, static_cast<double>(at.y) / 1000},
                                          static_cast<double>(reach) / 1000, limits_of(p));
    expect_as_costs(answer,
                    costs_under(*map, at, p, [&](const auto& corners) { return disc_meets(corners, at, reach); }));
    if (testing::Test::HasFatalFailure()) return;
    safe += answer.safe;
  }
  EXPECT_GT(safe, 300);
}

TEST(Footprint, PolygonsAreTheCostsOfTheTrianglesUnderThem) {
  const auto map = hazard_map(16);
  const Terrain terrain(map);
  Random random(6);
  int safe = 0;
  for (int round = 0; round < 1500; ++round) {
    const PlaceMm at{random.between(-1000, 97000), random.between(-1000, 97000)};
    std::vector<Place> polygon;
    std::vector<PlaceMm> polygon_mm;
    for (std::int64_t n = random.between(3, 6), size = random.between(200, 3000); n > 0; --n) {
      polygon_mm.push_back({at.x + random.between(-size, size), at.y + random.between(-size, size)});
      polygon.push_back(
          {static_cast<double>(polygon_mm.back().x) / 1000, static_cast<double>(polygon_mm.back().y) / 1000});
    }
    const Parameters p = car(random);
    const CheckAnswer answer = check_polygon(terrain, polygon, limits_of(p));
    expect_as_costs(answer,
                    costs_under(*map, at, p, [&](const auto& corners) { return polygons_meet(corners, polygon_mm); }));
    if (testing::Test::HasFatalFailure()) return;
    safe += answer.safe;
  }
  EXPECT_GT(safe, 100);
}

TEST(Footprint, ADiscAlongAPathSweepsACapsule) {
  const auto map = hazard_map(16);
  const Terrain terrain(map);
  Random random(9);
  int safe = 0;
  for (int round = 0; round < 1500; ++round) {
    const PlaceMm from{random.between(0, 96000), random.between(0, 96000)};
    PlaceMm to = from;
    (round % 2 == 0 ? to.x : to.y) += random.between(-5000, 5000);
    const std::int64_t reach = random.between(0, 1000);
    const Parameters p = car(random);
    const auto metres = [](PlaceMm at) {
      return Place{static_cast<double>(at.x) / 1000, static_cast<double>(at.y) / 1000};
    };
    const std::vector<Place> path = {metres(from), metres(to)};
    const CheckAnswer answer = check_path(terrain, path, static_cast<double>(reach) / 1000, limits_of(p));
    expect_worst(
        answer, costs_under(*map, from, p, [&](const auto& corners) {
          if (polygons_meet(corners, {from, to}) || disc_meets(corners, from, reach) || disc_meets(corners, to, reach))
            return true;
          return std::any_of(corners.begin(), corners.end(),
                             [&](PlaceMm corner) { return test::within(from, to, corner, reach); });
        }));
    if (testing::Test::HasFatalFailure()) return;
    safe += answer.safe;
  }
  EXPECT_GT(safe, 100);
}

bool operator==(const CheckAnswer& a, const CheckAnswer& b) {
  return a.safe == b.safe && a.traversability == b.traversability && a.hazard == b.hazard && a.at == b.at;
}

TEST(Footprint, TilesDontMatter) {
  const Terrain small(hazard_map(7)), large(hazard_map(64));
  Random random(8);
  const VehicleLimits limits;
  const std::vector<Place> box = {{-1, -0.7}, {2, -0.7}, {2, 0.7}, {-1, 0.7}};
  for (int round = 0; round < 2000; ++round) {
    const Place at{static_cast<double>(random.between(-1000, 97000)) / 1000,
                   static_cast<double>(random.between(-1000, 97000)) / 1000};
    ASSERT_TRUE(check_disc(small, at, 1.2, limits) == check_disc(large, at, 1.2, limits));
    const Pose2 pose{at, static_cast<double>(random.between(-400, 400)) / 100};
    ASSERT_TRUE(check_pose(small, pose, box, limits) == check_pose(large, pose, box, limits));
  }
}

// One tile of 6 x 6 level squares of 2 m at height 0, without a hazard.
class Yard {
 public:
  Yard() : tile_(2000, {0, 0, 6, 6}) {
    std::fill(tile_.corner_mm.begin(), tile_.corner_mm.end(), 0);
    std::fill(tile_.centre_mm.begin(), tile_.centre_mm.end(), 0);
    for (NodeSurface& node : tile_.nodes) node.state = NodeState::kObserved;
  }
  NodeSurface& node(Cell cell, std::uint8_t t) { return tile_.nodes[tile_.node_index({cell, t})]; }
  TerrainTile& tile() { return tile_; }
  Terrain terrain() const {
    auto map = std::make_shared<MemoryMap>(MapLayout{Lattice(2000), {6, {}}});
    map->put({0, 0}, TerrainTile(tile_));
    return Terrain(map);
  }

 private:
  TerrainTile tile_;
};

constexpr Place kMiddle{5, 5.5};  // in the north of square 2, 2

VehicleLimits tall() {
  VehicleLimits limits;
  limits.height_m = 2;
  return limits;
}

CheckAnswer after(void (*change)(NodeSurface&), const VehicleLimits& limits = tall()) {
  Yard yard;
  change(yard.node({2, 2}, kNorth));
  return check_disc(yard.terrain(), kMiddle, 0.1, limits);
}

TEST(Footprint, EveryHazardHasItsName) {
  EXPECT_EQ(after([](NodeSurface&) {}).traversability, 1);
  EXPECT_EQ(after([](NodeSurface& n) { n.step_mm = 201; }).hazard, Hazard::kStep);
  EXPECT_EQ(after([](NodeSurface& n) { n.step_mm = 50; }).traversability, 0.75);
  EXPECT_EQ(after([](NodeSurface& n) { n.roughness_mm = 5000; }).traversability, 0) << "as the map's cost";
  EXPECT_TRUE(after([](NodeSurface& n) { n.roughness_mm = 5000; }).safe);
  VehicleLimits smooth;
  smooth.roughness_m = 0.04;
  EXPECT_EQ(after([](NodeSurface& n) { n.roughness_mm = 41; }, smooth).hazard, Hazard::kRoughness);
  EXPECT_EQ(after([](NodeSurface& n) { n.roughness_mm = 10; }, smooth).traversability, 0.75);
  EXPECT_EQ(after([](NodeSurface& n) { n.clearance_mm = 1999; }).hazard, Hazard::kClearance);
  EXPECT_TRUE(after([](NodeSurface& n) { n.clearance_mm = 2000; }).safe);
  EXPECT_EQ(after([](NodeSurface& n) { n.state = NodeState::kObstacle; }).hazard, Hazard::kObstacle);
  EXPECT_EQ(after([](NodeSurface& n) { n.state = NodeState::kUnknown; }).hazard, Hazard::kUnknown);
  EXPECT_EQ(after([](NodeSurface& n) { n.state = NodeState::kFilled; }).hazard, Hazard::kUnknown);
  EXPECT_TRUE(after([](NodeSurface& n) { n.state = NodeState::kPredicted; }).safe);
  VehicleLimits seen;
  seen.predicted_is_safe = false;
  EXPECT_EQ(after([](NodeSurface& n) { n.state = NodeState::kPredicted; }, seen).hazard, Hazard::kUnknown);
  seen.unknown_is_safe = true;
  EXPECT_TRUE(after([](NodeSurface& n) { n.state = NodeState::kPredicted; }, seen).safe);
  EXPECT_FALSE(after([](NodeSurface& n) { n.state = NodeState::kObstacle; }, seen).safe);

  Yard slope;
  slope.tile().centre_mm[slope.tile().cell_index({2, 2})] = 400;  // 0.4 m over 1 m
  EXPECT_EQ(check_disc(slope.terrain(), kMiddle, 0, {}).hazard, Hazard::kSlope);
  VehicleLimits climber;
  climber.slope_deg = 22;
  EXPECT_NEAR(check_disc(slope.terrain(), kMiddle, 0, climber).traversability,
              1 - 0.4 / std::tan(22 * std::numbers::pi / 180), 1e-12);
  climber.slope_deg = 90;
  EXPECT_EQ(check_disc(slope.terrain(), kMiddle, 0, climber).traversability, 1);
}

TEST(Footprint, OutsideAndDamaged) {
  const Terrain yard = Yard().terrain();
  EXPECT_EQ(check_disc(yard, {11.5, 5}, 0.6, {}).hazard, Hazard::kOutside);
  EXPECT_EQ(check_disc(yard, {11.5, 5}, 0.5, {}).hazard, Hazard::kOutside) << "touches the border";
  EXPECT_TRUE(check_disc(yard, {11.5, 5}, 0.499, {}).safe);
  VehicleLimits explorer;
  explorer.unknown_is_safe = true;
  EXPECT_TRUE(check_disc(yard, {11.5, 5}, 0.6, explorer).safe);
  EXPECT_TRUE(check_disc(yard, {500, 500}, 0.6, explorer).safe);
  EXPECT_FALSE(check_disc(yard, {std::nan(""), 5}, 0.6, explorer).safe);

  const MemoryMap map = rolling_map(2);
  const auto source = std::make_shared<CountingMap>(map);
  source->refuse = true;
  EXPECT_EQ(check_disc(Terrain(source), {40, 40}, 0.5, explorer).hazard, Hazard::kDamaged);
}

TEST(Footprint, LimitsThatAreNoNumbersAreExceeded) {
  const Terrain yard = Yard().terrain();
  VehicleLimits level;
  level.slope_deg = level.step_m = 0;
  EXPECT_TRUE(check_disc(yard, kMiddle, 1, level).safe) << "level ground keeps limits of nothing";
  for (double VehicleLimits::*limit :
       {&VehicleLimits::slope_deg, &VehicleLimits::step_m, &VehicleLimits::roughness_m, &VehicleLimits::height_m})
    for (const double bad : {std::nan(""), -1.0}) {
      VehicleLimits limits;
      limits.*limit = bad;
      EXPECT_FALSE(check_disc(yard, kMiddle, 1, limits).safe);
    }
}

TEST(Footprint, ShapesThatAreNoneAreRefused) {
  const Terrain yard = Yard().terrain();
  for (const double radius : {-1.0, std::nan(""), kInfinity, 1e300, 1e6, 2.1e3})
    EXPECT_THROW(check_disc(yard, kMiddle, radius, {}), Error) << radius;
  const Place nowhere{kInfinity, 0};
  EXPECT_EQ(check_disc(yard, nowhere, 1, {}).hazard, Hazard::kOutside);
  const std::vector<Place> two = {{1, 1}, {2, 2}, {1, 1}, {2, 2}}, none;
  EXPECT_THROW(check_polygon(yard, two, {}), Error);
  EXPECT_THROW(check_polygon(yard, none, {}), Error);
  EXPECT_THROW(check_polygon(yard, std::vector<Place>(kMostVertices + 1, Place{1, 1}), {}), Error);
  const std::vector<Place> line = {{1, 1}, {2, 2}, {3, 3}}, giant = {{-1e7, 0}, {1e7, 0}, {0, 1e7}},
                           thin = {{-6e7, 0}, {6e7, 0}, {0, 1}}, lost = {{1, 1}, {2, 2}, nowhere};
  EXPECT_TRUE(check_polygon(yard, line, {}).safe);
  EXPECT_THROW(check_polygon(yard, giant, {}), Error);
  EXPECT_THROW(check_polygon(yard, thin, {}), Error);
  EXPECT_EQ(check_polygon(yard, lost, {}).hazard, Hazard::kOutside);
  EXPECT_THROW(check_pose(yard, {kMiddle, 0}, lost, {}), Error) << "a footprint is a shape, not a place";
  EXPECT_THROW(check_pose(yard, {kMiddle, 0}, giant, {}), Error);
  EXPECT_FALSE(check_pose(yard, {kMiddle, kInfinity}, line, {}).safe);
  EXPECT_FALSE(check_pose(yard, {nowhere, 0}, line, {}).safe);
  EXPECT_THROW(check_path(yard, none, line, {}), Error);
  EXPECT_THROW(check_path(yard, none, 1, {}), Error);
  EXPECT_THROW(check_path(yard, line, -1, {}), Error);
  EXPECT_THROW(check_path(yard, line, 1e4, {}), Error);
  EXPECT_EQ(check_path(yard, std::vector<Place>{kMiddle, nowhere, kMiddle}, 0.1, {}).hazard, Hazard::kOutside);
  const std::vector<Place> far = {{0, 0}, {6e7, 6e7}};
  EXPECT_THROW(check_path(yard, far, line, {}), Error);
  EXPECT_THROW(check_path(yard, far, 1, {}), Error);
  EXPECT_EQ(check_path(yard, std::vector<Place>{kMiddle, nowhere, kMiddle}, line, {}).hazard, Hazard::kOutside);
}

const std::vector<Place> kBody = {{-0.5, -0.4}, {1, -0.4}, {1, 0.4}, {-0.5, 0.4}};

TEST(Footprint, APoseIsItsPolygon) {
  const Terrain terrain(hazard_map(16));
  for (int k = 0; k < 500; ++k) {
    const Place at{2 + k * 0.18, 90 - k * 0.15};
    std::vector<Place> turned;
    for (const Place p : kBody) turned.push_back({at.x_m - p.y_m, at.y_m + p.x_m});
    ASSERT_TRUE(check_pose(terrain, {at, std::numbers::pi / 2}, kBody, {}) == check_polygon(terrain, turned, {})) << k;
  }
}

TEST(Footprint, AStraightPathIsWhatItSweeps) {
  const Terrain terrain(hazard_map(16));
  int safe = 0;
  for (int k = 0; k < 700; ++k) {
    const Place from{2 + k % 90 * 1.0, 3 + k * 0.125};
    const double way = 0.5 + k % 7;
    const std::vector<Place> path = {from, {from.x_m + way / 3, from.y_m}, {from.x_m + way, from.y_m}};
    const std::vector<Place> swept = {{from.x_m - 0.5, from.y_m - 0.4},
                                      {from.x_m + way + 1, from.y_m - 0.4},
                                      {from.x_m + way + 1, from.y_m + 0.4},
                                      {from.x_m - 0.5, from.y_m + 0.4}};
    VehicleLimits limits;
    limits.step_m = 0.3;
    const CheckAnswer along = check_path(terrain, path, kBody, limits), whole = check_polygon(terrain, swept, limits);
    ASSERT_EQ(along.safe, whole.safe) << k;
    ASSERT_EQ(along.traversability, whole.traversability) << k;
    safe += along.safe;
  }
  EXPECT_GT(safe, 70);
  EXPECT_LT(safe, 630);
}

// A post beside the bend that neither way touches: only the turn does.
TEST(Footprint, TurningSweepsToo) {
  Yard yard;
  yard.node({4, 4}, kSouth).state = NodeState::kObstacle;  // 8..10, 8..9
  const Terrain terrain = yard.terrain();
  const std::vector<Place> boom = {{0, -0.1}, {3.5, -0.1}, {3.5, 0.1}, {0, 0.1}};
  const std::vector<Place> bend = {{4, 6.5}, {6.5, 6.5}, {6.5, 8}};
  EXPECT_TRUE(check_path(terrain, std::span(bend).first(2), boom, {}).safe);
  EXPECT_TRUE(check_path(terrain, std::span(bend).last(2), boom, {}).safe);
  const CheckAnswer answer = check_path(terrain, bend, boom, {});
  EXPECT_EQ(answer.hazard, Hazard::kObstacle);
  EXPECT_NEAR(answer.at.x_m, 9, 1e-9);
  EXPECT_NEAR(answer.at.y_m, 8 + 1 / 3.0, 1e-9);
  const std::vector<Place> other_way = {{6.5, 4}, {6.5, 5}, {5, 5}};
  EXPECT_TRUE(check_path(terrain, other_way, boom, {}).safe) << "the shorter way round, by the north-west";
}

TEST(Footprint, TheFirstHazardOfAPath) {
  Yard yard;
  yard.node({4, 2}, kWest).step_mm = 900;
  yard.node({2, 2}, kWest).state = NodeState::kObstacle;
  const Terrain terrain = yard.terrain();
  const std::vector<Place> east = {{2, 5}, {10, 5}}, west = {{10, 5}, {2, 5}}, stand = {{3, 5}, {3, 5}};
  EXPECT_EQ(check_path(terrain, east, kBody, {}).hazard, Hazard::kObstacle);
  EXPECT_EQ(check_path(terrain, west, kBody, {}).hazard, Hazard::kStep);
  EXPECT_TRUE(check_path(terrain, stand, kBody, {}) == check_pose(terrain, {{3, 5}, 0}, kBody, {}));
}

}  // namespace
}  // namespace btms::test
