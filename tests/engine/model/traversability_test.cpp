// Steps, costs and what lies under a vehicle.
#include "engine/model/traversability.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace btms {
namespace {

constexpr std::int32_t kR_mm = 2000;
using Height = std::function<double(double x_m, double y_m)>;  // in metres

// Corners of a node on a surface that goes through `height` at every corner.
NodeCorners corners_on(const Height& height, Cell cell, std::uint8_t triangle) {
  NodeCorners out;
  const auto rel = triangle_corners(triangle);
  for (std::size_t k = 0; k < 3; ++k)
    out.mm[k] = static_cast<std::int32_t>(std::lround(
        1000 * height((cell.col + rel[k].x / 2.0) * kR_mm / 1000, (cell.row + rel[k].y / 2.0) * kR_mm / 1000)));
  return out;
}

int step_on(const Height& height, Cell cell, std::uint8_t triangle) {
  std::array<NodeCorners, kNeighbours> near;
  std::array<const NodeCorners*, kNeighbours> around;
  for (std::size_t k = 0; k < kNeighbours; ++k) {
    const NodeOffset o = kNeighbourTable[triangle][k];
    near[k] = corners_on(height, {cell.col + o.col, cell.row + o.row}, o.triangle);
    around[k] = &near[k];
  }
  return step_mm(triangle, corners_on(height, cell, triangle), around);
}

int highest_step(const Height& height) {
  int highest = 0;
  for (std::int32_t row = -3; row < 3; ++row)
    for (std::int32_t col = -3; col < 3; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) highest = std::max(highest, step_on(height, {col, row}, t));
  return highest;
}

TEST(Step, SlopesCrestsAndFootsOfSlopesAreNone) {
  EXPECT_EQ(highest_step([](double, double) { return 7.0; }), 0);
  EXPECT_LE(highest_step([](double x, double y) { return 0.7 * x - 0.4 * y; }), 10);
  EXPECT_LE(highest_step([](double x, double) { return std::abs(x) * 0.5; }), 10);
  EXPECT_LE(highest_step([](double x, double y) { return -std::abs(x + y) * 0.4; }), 10);
  EXPECT_LE(highest_step([](double x, double) { return std::max(0.0, x) * 0.6; }), 10);
  EXPECT_LE(highest_step([](double x, double y) { return (x * x + y * y) / 60; }), 10);
}

// Rough ground: every row of squares at once says what every node says by itself.
TEST(Step, ARowIsWhatItsNodesAre) {
  constexpr std::int32_t kCols = 21;
  const Height rough = [](double x, double y) {
    const auto ix = static_cast<std::uint32_t>(std::lround(x) + 100),
               iy = static_cast<std::uint32_t>(std::lround(y) + 100);
    const std::uint32_t hash = (ix * 2654435761u + iy * 40503u) * 2246822519u;
    return static_cast<double>(hash >> 20) / 500 + (ix > 120 ? 5000 : 0);
  };
  const auto height_mm = [&](double col, double row) {
    return static_cast<std::int32_t>(std::lround(1000 * rough(col * kR_mm / 1000, row * kR_mm / 1000)));
  };
  std::array<std::vector<std::int32_t>, 4> corner;
  std::array<std::vector<std::int32_t>, 3> centre;
  HeightRows rows;
  for (std::size_t k = 0; k < 4; ++k) {
    for (int col = -1; col <= kCols + 1; ++col) corner[k].push_back(height_mm(col, static_cast<double>(k) - 1));
    rows.corner_mm[k] = corner[k].data();
  }
  for (std::size_t k = 0; k < 3; ++k) {
    for (int col = -1; col <= kCols; ++col) centre[k].push_back(height_mm(col + 0.5, static_cast<double>(k) - 0.5));
    rows.centre_mm[k] = centre[k].data();
  }
  StepRow steps;
  int highest = 0;
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    const auto row = steps.of(t, rows, kCols);
    ASSERT_EQ(row.size(), static_cast<std::size_t>(kCols));
    for (std::int32_t col = 0; col < kCols; ++col) {
      EXPECT_EQ(row[static_cast<std::size_t>(col)], step_on(rough, {col, 0}, t)) << "column " << col;
      highest = std::max<int>(highest, row[static_cast<std::size_t>(col)]);
    }
  }
  EXPECT_EQ(highest, 65530) << "saturates";
}

// Wherever and however a wall runs through the lattice, and on slopes too.
TEST(Step, AWallIsAsHighAsItIs) {
  for (const double h : {0.1, 0.3, 1.0, 5.0})
    for (const double angle : {0.0, 0.2, 0.5, 0.785398, 1.1, 1.570796})
      for (const double shift : {-0.9, -0.5, 0.05, 0.3, 0.7})
        for (const double slope : {0.0, 0.1}) {
          const double c = std::cos(angle), s = std::sin(angle);
          const int found =
              highest_step([&](double x, double y) { return (c * x + s * y > shift ? h : 0) + slope * x; });
          const double spare = 4 * slope * kR_mm;
          EXPECT_GE(found, 990 * h) << h << ' ' << angle << ' ' << shift << ' ' << slope;
          EXPECT_LE(found, 1010 * h + spare) << h << ' ' << angle << ' ' << shift << ' ' << slope;
        }
}

// A ramp of four squares is none, one of one square is as bad as a wall.
TEST(Step, ShortRampsLookLikeWalls) {
  const auto ramp = [](double length_m) {
    return [length_m](double x, double) { return std::clamp(x / length_m, 0.0, 1.0); };
  };
  EXPECT_GE(highest_step(ramp(2)), 990);
  EXPECT_LE(highest_step(ramp(8)), 10);
}

TEST(Step, UnknownGroundSaysNothing) {
  const NodeCorners own{{0, 1000, 1000}}, unknown;
  std::array<const NodeCorners*, kNeighbours> around;
  around.fill(&unknown);
  EXPECT_EQ(step_mm(kEast, own, around), 0);
}

TEST(Cost, IsTheWorstShareOfALimit) {
  Parameters p;
  p.resolution_m = kR_mm / 1000.0;
  const Vehicle car(p);  // 2 m high, 20 degrees, 0.2 m
  NodeSurface node;
  const auto cost = [&](double slope) { return int{car.cost(node, {0, 0, static_cast<std::int64_t>(slope * kR_mm)})}; };
  EXPECT_EQ(cost(0), kNotTraversable) << "unknown";
  node.state = NodeState::kObserved;
  EXPECT_EQ(cost(0), 0);
  EXPECT_EQ(cost(std::tan(20 * 3.14159265 / 180) / 2), 127);
  EXPECT_EQ(cost(0.36), 251);
  EXPECT_EQ(cost(0.37), kNotTraversable);
  node.step_mm = 150;
  EXPECT_EQ(cost(0.1), 191);
  node.step_mm = 210;
  EXPECT_EQ(cost(0), kNotTraversable);
  node.step_mm = 0;
  node.roughness_mm = 25;
  EXPECT_EQ(cost(0), 64);
  node.roughness_mm = 5000;
  EXPECT_EQ(cost(0), 254) << "rough ground alone stops nobody";
  node.roughness_mm = 0;
  node.clearance_mm = 1999;
  EXPECT_EQ(cost(0), kNotTraversable);
  node.clearance_mm = 2000;
  EXPECT_EQ(cost(0), 0);
  for (const NodeState state : {NodeState::kObstacle, NodeState::kFilled}) {
    node.state = state;
    EXPECT_EQ(cost(0), kNotTraversable);
  }
  node.state = NodeState::kPredicted;
  EXPECT_EQ(cost(0), 0);
}

// Against distances to points strewn over every triangle.
TEST(Vehicle, FootprintHoldsTheNodesWithinHalfItsWidth) {
  for (const double width_m : {0.0, 0.6, 1.4, 1.8, 5.0, 13.0}) {
    Parameters p;
    p.resolution_m = kR_mm / 1000.0;
    p.vehicle_width_m = width_m;
    const Vehicle vehicle(p);
    const std::int32_t reach = vehicle.rings() + 1;
    std::int32_t furthest = 0;
    for (std::uint8_t t = 0; t < kTriangles; ++t) {
      const double x = static_cast<double>(centroid_x3(t, kR_mm)) / 3,
                   y = static_cast<double>(centroid_y3(t, kR_mm)) / 3;
      const auto& under = vehicle.footprint(t);
      for (std::int32_t row = -reach; row <= reach; ++row)
        for (std::int32_t col = -reach; col <= reach; ++col)
          for (std::uint8_t u = 0; u < kTriangles; ++u) {
            double nearest = 1e9;
            const auto rel = triangle_corners(u);
            for (int i = 0; i <= 60; ++i)
              for (int k = 0; k <= 60 - i; ++k) {
                const double a = i / 60.0, b = k / 60.0, c = 1 - a - b;
                const double px = (col + (a * rel[0].x + b * rel[1].x + c * rel[2].x) / 2 - 0.5) * kR_mm;
                const double py = (row + (a * rel[0].y + b * rel[1].y + c * rel[2].y) / 2 - 0.5) * kR_mm;
                nearest = std::min(nearest, std::hypot(px - x, py - y));
              }
            const bool own = col == 0 && row == 0 && u == t;
            const NodeOffset o{static_cast<std::int8_t>(col), static_cast<std::int8_t>(row), u};
            const bool found = std::find(under.begin(), under.end(), o) != under.end();
            if (found) furthest = std::max({furthest, std::abs(col), std::abs(row)});
            const bool near = own || nearest <= width_m * 500, far = !own && nearest > width_m * 500 + 40;
            if (near || far) {  // else too close for the points strewn to tell
              EXPECT_EQ(found, near) << width_m << ' ' << int{t} << ' ' << col << ' ' << row << ' ' << int{u};
            }
          }
    }
    EXPECT_EQ(furthest, vehicle.rings()) << width_m;
  }
}

}  // namespace
}  // namespace btms
