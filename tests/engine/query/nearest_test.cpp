// The nearest traversable place against all there are.
#include "engine/query/nearest.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/error.h"
#include "tests/engine/query/hazard_map.h"

namespace btms::test {
namespace {

TEST(Nearest, IsTheNearestOfAll) {
  const Terrain terrain(hazard_map(16));
  const Lattice lattice(2000);
  Random random(4);
  VehicleLimits limits;
  limits.step_m = 0.05;
  int none = 0, here = 0;
  for (int round = 0; round < 60; ++round) {
    const Place from{static_cast<double>(random.between(-6000, 100000)) / 1000,
                     static_cast<double>(random.between(-6000, 100000)) / 1000};
    const double radius = round % 3 * 0.6, most = round % 5 * 2;
    const std::optional<Place> found = nearest_traversable(terrain, from, radius, most, limits);
    if (check_disc(terrain, from, radius, limits).safe) {
      ASSERT_EQ(found, from);
      ++here;
      continue;
    }
    double best = INFINITY;
    for (Cell cell{-6, -6}; cell.row < 54; ++cell.row)
      for (cell.col = -6; cell.col < 54; ++cell.col)
        for (std::uint8_t t = 0; t < kTriangles; ++t) {
          const Place at{static_cast<double>(lattice.centre_x_mm(cell) + floor_div(centroid_x3(t, 2000), 3)) / 1000,
                         static_cast<double>(lattice.centre_y_mm(cell) + floor_div(centroid_y3(t, 2000), 3)) / 1000};
          const double distance = std::hypot(at.x_m - from.x_m, at.y_m - from.y_m);
          if (distance < best && check_disc(terrain, at, radius, limits).safe) best = distance;
        }
    ASSERT_EQ(found.has_value(), best <= most) << best << " " << most;
    if (found) {
      ASSERT_NEAR(std::hypot(found->x_m - from.x_m, found->y_m - from.y_m), best, 1e-6);
      ASSERT_TRUE(check_disc(terrain, *found, radius, limits).safe);
    } else {
      ++none;
    }
  }
  EXPECT_GT(none, 5);
  EXPECT_LT(none, 40);
  EXPECT_GT(here, 3);
}

TEST(Nearest, NowhereAndTooFar) {
  const Terrain terrain(hazard_map(16));
  EXPECT_FALSE(nearest_traversable(terrain, {NAN, 1}, 0, 10, {}));
  EXPECT_FALSE(nearest_traversable(terrain, {-500, 1}, 0, 10, {}));
  EXPECT_THROW(nearest_traversable(terrain, {1, 1}, 0, NAN, {}), Error);
  EXPECT_THROW(nearest_traversable(terrain, {1, 1}, 0, -1, {}), Error);
  EXPECT_THROW(nearest_traversable(terrain, {1, 1}, 0, 1e6, {}), Error);
  EXPECT_THROW(nearest_traversable(terrain, {1, 1}, 0, INFINITY, {}), Error);
}

}  // namespace
}  // namespace btms::test
