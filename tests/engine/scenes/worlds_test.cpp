// What each world must hold to be worth measuring with.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "engine/scenes/scene.h"

namespace btms {
namespace {

struct Census {
  std::unique_ptr<Scene> scene;
  std::vector<ScenePoint> points;
  std::map<SceneClass, double> share;

  Census(const char* name, std::uint64_t count, double density, std::uint64_t seed = 1) {
    scene = Scene::create({.name = name, .seed = seed, .density_per_m2 = density, .points = count});
    for (std::size_t b = 0; b < scene->blocks(); ++b) scene->generate(b, points);
    for (const ScenePoint& p : points) share[p.label] += 1.0 / static_cast<double>(points.size());
  }
  double ground(double x_m, double y_m) const { return scene->ground_z_m(x_m, y_m); }
  // Steepest ground found over steps of 10 cm, as a tangent, and the heights' range.
  struct Relief {
    double steepest, low_m, high_m;
  };
  Relief relief() const {
    Relief r{0, 1e9, -1e9};
    for (int i = 0; i < 300; ++i)
      for (int j = 0; j < 300; ++j) {
        const double x = scene->width_m() * i / 300, y = scene->height_m() * j / 300, z = ground(x, y);
        const double dx = (ground(x + 0.1, y) - z) / 0.1, dy = (ground(x, y + 0.1) - z) / 0.1;
        r = {std::max(r.steepest, std::sqrt(dx * dx + dy * dy)), std::min(r.low_m, z), std::max(r.high_m, z)};
      }
    return r;
  }
};

class CityOfSeed : public testing::TestWithParam<std::uint64_t> {};
INSTANTIATE_TEST_SUITE_P(City, CityOfSeed, testing::Values(1, 2, 3));

TEST_P(CityOfSeed, HasEverythingInSensibleShares) {
  Census city("city", 2'000'000, 5, GetParam());
  EXPECT_GT(city.share[SceneClass::kBuilding], 0.22);
  EXPECT_LT(city.share[SceneClass::kBuilding], 0.38);
  EXPECT_GT(city.share[SceneClass::kGround], 0.5);
  EXPECT_GT(city.share[SceneClass::kHighVegetation], 0.02);
  EXPECT_GT(city.share[SceneClass::kLowVegetation], 0.005);
  EXPECT_GT(city.share[SceneClass::kVehicle], 0.005);
  EXPECT_GT(city.share[SceneClass::kBridgeDeck], 0.003);
  EXPECT_GT(city.share[SceneClass::kLowNoise], 0);
  EXPECT_LT(city.share[SceneClass::kLowNoise], 2e-5);
  const auto relief = city.relief();
  EXPECT_GT(relief.high_m - relief.low_m, 8);
}

TEST(City, HasLargeFlatRoofs) {
  // Roof points in cells of 2 m that hold nothing but roof within a hand's breadth of one height.
  const Census city("city", 1'000'000, 5);
  struct Cell {
    int low_mm = INT32_MAX, high_mm = INT32_MIN;
    bool roof = true;
    std::size_t count = 0;
  };
  std::map<std::pair<std::int64_t, std::int64_t>, Cell> cells;
  for (const ScenePoint& p : city.points) {
    if (p.label == SceneClass::kHighVegetation) continue;
    Cell& c = cells[{p.x_mm / 2000, p.y_mm / 2000}];
    c.low_mm = std::min(c.low_mm, p.z_mm);
    c.high_mm = std::max(c.high_mm, p.z_mm);
    c.roof = c.roof && p.label == SceneClass::kBuilding;
    ++c.count;
  }
  std::size_t flat = 0, roofs = 0;
  for (const auto& [key, c] : cells)
    if (c.roof && c.high_mm - c.low_mm < 150) flat += c.count;
  for (const ScenePoint& p : city.points) roofs += p.label == SceneClass::kBuilding;
  EXPECT_GT(static_cast<double>(flat), 0.45 * static_cast<double>(roofs));
}

TEST(City, BridgesSpanTheCuttingAndJoinBothBanks) {
  const Census city("city", 1'000'000, 5);
  double deepest = 0, nearest = 1e9;
  for (const ScenePoint& p : city.points) {
    if (p.label != SceneClass::kBridgeDeck) continue;
    const double above =
        p.z_mm / 1000.0 - city.ground(static_cast<double>(p.x_mm) / 1000, static_cast<double>(p.y_mm) / 1000);
    deepest = std::max(deepest, above);
    nearest = std::min(nearest, above);
    ASSERT_GT(above, -0.1);
  }
  EXPECT_GT(deepest, 5);
  EXPECT_LT(nearest, 0.2);
}

TEST(City, HasClosedCourtyards) {
  // Ground that cannot be left without crossing a building, larger than 20 x 20 m, on a grid of 2 m.
  const auto scene = Scene::create({.name = "city", .seed = 1, .density_per_m2 = 10, .points = 2'000'000});
  const int n = static_cast<int>(scene->width_m() / 2);
  std::vector<char> open(static_cast<std::size_t>(n * n));
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x)
      open[static_cast<std::size_t>(y * n + x)] = scene->cover(2 * x + 1, 2 * y + 1) != SceneClass::kBuilding;
  std::size_t yards = 0;
  for (int start = 0; start < n * n; ++start) {
    if (!open[static_cast<std::size_t>(start)]) continue;
    std::vector<int> stack{start};
    open[static_cast<std::size_t>(start)] = 0;
    std::size_t area = 0;
    bool border = false;
    while (!stack.empty()) {
      const int at = stack.back(), x = at % n, y = at / n;
      stack.pop_back();
      ++area;
      if (x == 0 || y == 0 || x == n - 1 || y == n - 1) {
        border = true;
        continue;
      }
      for (const int next : {at - 1, at + 1, at - n, at + n})
        if (open[static_cast<std::size_t>(next)]) {
          open[static_cast<std::size_t>(next)] = 0;
          stack.push_back(next);
        }
    }
    if (!border && area > 100) ++yards;
  }
  EXPECT_GE(yards, 1u);
}

TEST(City, HasKerbs) {
  const auto scene = Scene::create({.name = "city", .seed = 1, .density_per_m2 = 10, .points = 1'000'000});
  std::size_t kerbs = 0;
  for (int row = 0; row < 20; ++row)
    for (double x = 0; x + 0.02 < scene->width_m(); x += 0.02) {
      const double y = scene->height_m() * (row + 0.5) / 20;
      const double step = std::abs(scene->ground_z_m(x + 0.02, y) - scene->ground_z_m(x, y));
      kerbs += step > 0.11 && step < 0.13;
    }
  EXPECT_GT(kerbs, 40u);
}

TEST(Hills, AreSmoothAndSteepToThirtyFiveDegrees) {
  Census hills("hills", 1'000'000, 5);
  const auto relief = hills.relief();
  EXPECT_GT(relief.steepest, 0.5);
  EXPECT_LT(relief.steepest, 0.75);
  EXPECT_GT(relief.high_m - relief.low_m, 40);
  EXPECT_GT(hills.share[SceneClass::kHighVegetation], 0.1);
  EXPECT_LT(hills.share[SceneClass::kHighVegetation], 0.6);
  EXPECT_GT(hills.share[SceneClass::kUnclassified], 0.002);
}

TEST(Quarry, HasCliffsBenchesAndHeaps) {
  Census quarry("quarry", 1'000'000, 5);
  const auto relief = quarry.relief();
  EXPECT_GT(relief.steepest, 4);
  EXPECT_GT(relief.high_m - relief.low_m, 36);
  EXPECT_GT(quarry.share[SceneClass::kGround], 0.85);
  EXPECT_GT(quarry.share[SceneClass::kVehicle], 0);
}

TEST(Bumpy, HasMoundsAndPitsEverywhere) {
  const Census field("bumpy", 1'000'000, 50);
  // Heights within squares of 8 m.
  std::vector<double> ranges;
  for (double x0 = 0; x0 + 8 < field.scene->width_m(); x0 += 8)
    for (double y0 = 0; y0 + 8 < field.scene->height_m(); y0 += 8) {
      double low = 1e9, high = -1e9;
      for (double x = 0; x <= 8; x += 0.25)
        for (double y = 0; y <= 8; y += 0.25) {
          low = std::min(low, field.ground(x0 + x, y0 + y));
          high = std::max(high, field.ground(x0 + x, y0 + y));
        }
      ranges.push_back(high - low);
    }
  std::sort(ranges.begin(), ranges.end());
  EXPECT_GT(ranges.front(), 0.3);
  EXPECT_GT(ranges[ranges.size() / 2], 0.8);
  EXPECT_LT(ranges.back(), 4);
}

TEST(Forest, IsDenseSteepAndRough) {
  Census forest("forest", 2'000'000, 25);
  EXPECT_GT(forest.share[SceneClass::kGround], 0.15);
  EXPECT_LT(forest.share[SceneClass::kGround], 0.3);
  EXPECT_GT(forest.share[SceneClass::kLowVegetation], 0.015);
  EXPECT_GT(forest.share[SceneClass::kUnclassified], 0.001);
  // Slopes over 20 m.
  std::vector<double> slopes;
  for (double x = 20; x < forest.scene->width_m() - 20; x += 7)
    for (double y = 20; y < forest.scene->height_m() - 20; y += 7) {
      const double dx = (forest.ground(x + 10, y) - forest.ground(x - 10, y)) / 20;
      const double dy = (forest.ground(x, y + 10) - forest.ground(x, y - 10)) / 20;
      slopes.push_back(std::sqrt(dx * dx + dy * dy));
    }
  std::sort(slopes.begin(), slopes.end());
  EXPECT_GT(slopes[slopes.size() / 10], 0.17);
  EXPECT_GT(slopes[slopes.size() / 2], 0.35);
  EXPECT_LT(slopes[slopes.size() * 99 / 100], 0.75);
  // Ground points are uneven: shares per square of 10 m.
  std::map<std::pair<std::int64_t, std::int64_t>, std::pair<double, double>> cells;
  for (const ScenePoint& p : forest.points) {
    auto& [ground, all] = cells[{p.x_mm / 10'000, p.y_mm / 10'000}];
    ground += p.label == SceneClass::kGround;
    all += 1;
  }
  std::vector<double> shares;
  for (const auto& [cell, c] : cells) shares.push_back(c.first / c.second);
  std::sort(shares.begin(), shares.end());
  EXPECT_LT(shares[shares.size() / 10], 0.08);
  EXPECT_GT(shares[shares.size() * 9 / 10], 0.3);
}

TEST(Halls, AreLargeFlatAndSomeAreFlushWithABank) {
  Census halls("halls", 2'000'000, 10);
  EXPECT_GT(halls.share[SceneClass::kBuilding], 0.15);
  EXPECT_LT(halls.share[SceneClass::kBuilding], 0.5);
  EXPECT_GT(halls.share[SceneClass::kVehicle], 0.01);
  // Roofs that the ground reaches within 2 m to the side and 0.5 m in height; roofs that stand clear.
  std::size_t flush = 0, clear = 0;
  for (std::size_t i = 0; i < halls.points.size(); i += 17) {
    const ScenePoint& p = halls.points[i];
    const double x = static_cast<double>(p.x_mm) / 1000, y = static_cast<double>(p.y_mm) / 1000, z = p.z_mm / 1000.0;
    if (p.label != SceneClass::kBuilding || z < halls.ground(x, y) + 7) continue;
    double nearest = 99;
    for (const auto& [dx, dy] : {std::pair{2.0, 0.0}, {-2.0, 0.0}, {0.0, 2.0}, {0.0, -2.0}})
      nearest = std::min(nearest, std::abs(halls.ground(x + dx, y + dy) - z));
    ++(nearest < 0.5 ? flush : clear);
  }
  EXPECT_GT(flush, 50u);
  EXPECT_GT(clear, 20 * flush);
}

TEST(Hillside, IsDugIntoTerracedAndCrossedByARoad) {
  Census hillside("hillside", 2'000'000, 10);
  EXPECT_GT(hillside.share[SceneClass::kBuilding], 0.02);
  EXPECT_GT(hillside.share[SceneClass::kGround], 0.8);
  // Pulses that meet a roof within half a metre above the ground beside it: eaves dug in.
  std::size_t dug_in = 0, steps = 0, places = 0;
  for (std::size_t i = 0; i < hillside.points.size(); i += 7) {
    const ScenePoint& p = hillside.points[i];
    const double x = static_cast<double>(p.x_mm) / 1000, y = static_cast<double>(p.y_mm) / 1000;
    if (p.label == SceneClass::kBuilding) dug_in += p.z_mm / 1000.0 < hillside.ground(x, y) + 0.6;
    if (i % 5 != 0) continue;
    ++places;
    steps += hillside.scene->truth(x, y).at_step;
  }
  EXPECT_GT(dug_in, 100u);
  EXPECT_GT(static_cast<double>(steps), 0.03 * static_cast<double>(places));
  EXPECT_LT(static_cast<double>(steps), 0.2 * static_cast<double>(places));
}

TEST(Overpass, HasASecondSurfaceAndRoadPointsBelowIt) {
  Census overpass("overpass", 2'000'000, 10);
  EXPECT_GT(overpass.share[SceneClass::kBridgeDeck], 0.005);
  // Heights of decks above the road; ground points well inside below decks, and deck ends that meet the ground.
  std::size_t high = 0, ends = 0, below = 0, deep = 0;
  for (const ScenePoint& p : overpass.points) {
    if (p.label != SceneClass::kBridgeDeck && p.label != SceneClass::kGround) continue;
    const double x = static_cast<double>(p.x_mm) / 1000, y = static_cast<double>(p.y_mm) / 1000;
    if (p.label == SceneClass::kBridgeDeck) {
      const double above = p.z_mm / 1000.0 - overpass.ground(x, y);
      ASSERT_LT(above, 8.5);
      high += above > 4.5;
      ends += above < 0.5;
    } else if (p.x_mm % 5 == 0 && overpass.scene->cover(x, y) == SceneClass::kBridgeDeck) {
      ++below;
      // Further in than a pulse from the side gets.
      deep += overpass.scene->cover(x - 3.2, y) == SceneClass::kBridgeDeck &&
              overpass.scene->cover(x + 3.2, y) == SceneClass::kBridgeDeck;
    }
  }
  EXPECT_GT(high, 5000u);
  EXPECT_GT(ends, 100u);
  EXPECT_GT(below, deep + 200);
  EXPECT_GT(deep, 100u);
}

TEST(Indoor, HasACeilingOverTwoLevels) {
  Census storey("indoor", 1'000'000, 400);
  EXPECT_GT(storey.share[SceneClass::kCeiling], 0.4);
  EXPECT_GT(storey.share[SceneClass::kGround], 0.3);
  EXPECT_GT(storey.share[SceneClass::kBuilding], 0.02);
  EXPECT_GT(storey.share[SceneClass::kUnclassified], 0.005);
  const auto relief = storey.relief();
  EXPECT_DOUBLE_EQ(relief.low_m, 0);
  EXPECT_DOUBLE_EQ(relief.high_m, 0.45);
  for (const ScenePoint& p : storey.points) {
    if (p.label == SceneClass::kCeiling) {
      ASSERT_GT(p.z_mm, 3000);
    }
  }
}

}  // namespace
}  // namespace btms
