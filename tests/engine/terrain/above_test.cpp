// Layers and sheets of one node.
#include "engine/terrain/above.h"

#include <gtest/gtest.h>

#include <cstring>

#include "engine/terrain/parameters.h"
#include "tests/support/cloud.h"
#include "tests/support/node_cloud.h"

namespace btms::test {
namespace {

constexpr std::int32_t kR_mm = 2000, kTerrain_mm = 120;
const LevelRules kRules(preset("city"), kR_mm, false, false);
// The surface rises 1 in 10 to the east: 10 m at the square's centre.
constexpr FinalPlane kSurface{10'000, 200, 0};

std::int64_t surface_at(std::int64_t x) { return 10'000 + x / 10; }

struct Looked {
  NodeLook look;
  std::vector<NodeSheet> sheets;
};

Looked look(const NodeCloud& cloud) {
  std::vector<std::int32_t> heights(cloud.points().size);
  SheetFinder finder(kRules);
  const NodeLook look = look_over(cloud.points(), kSurface, kR_mm, kTerrain_mm, finder.room_mm(), heights.data());
  SheetFinder::Square square{};
  square[kEast] = {cloud.points(), heights.data(), kSurface, kTerrain_mm, look.off};
  finder.find(square);
  const auto sheets = finder.sheets(kEast);
  return {look, {sheets.begin(), sheets.end()}};
}

// n points `above_mm` over the surface, leaning by `slope` to the north, within +-noise.
void add(NodeCloud& cloud, Random& random, int n, std::int64_t above_mm, double slope = 0, std::int64_t noise_mm = 20) {
  for (int i = 0; i < n; ++i) {
    const std::int64_t x = random.between(300, 990), y = random.between(-290, 290);
    cloud.add(x, y,
              surface_at(x) + above_mm + static_cast<std::int64_t>(slope * static_cast<double>(y)) +
                  random.between(-noise_mm, noise_mm));
  }
}

// Points at these heights over the surface.
NodeLook look_at(const std::vector<std::int64_t>& heights, std::vector<std::int32_t>& seen) {
  NodeCloud cloud;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const auto x = static_cast<std::int64_t>(100 * i);
    cloud.add(x, -x / 2, surface_at(x) + heights[i]);
  }
  seen.resize(heights.size());
  return look_over(cloud.points(), kSurface, kR_mm, kTerrain_mm, 1'800, seen.data());
}

TEST(LookOver, RoughnessIsTheRmsOfTheTerrainPoints) {
  std::vector<std::int32_t> heights;
  const NodeLook look = look_at({30, -30, 30, -30, 120, -121, 900, -1800, -1801}, heights);
  EXPECT_EQ(look.roughness_mm, 60) << "sqrt((4 * 30^2 + 120^2) / 5) = 60; -121 and 900 are no terrain";
  EXPECT_EQ(look.clearance_mm, 900);
  EXPECT_EQ(look.off, 2) << "900 and -1801";
  EXPECT_EQ(heights, (std::vector<std::int32_t>{30, -30, 30, -30, 120, -121, 900, -1800, -1801}));
}

TEST(LookOver, NothingAboveIsSaidSo) {
  std::vector<std::int32_t> heights;
  EXPECT_EQ(look_at({0, 119, -500}, heights).clearance_mm, kNoneAbove);
  EXPECT_EQ(look_at({}, heights).clearance_mm, kNoneAbove);
}

TEST(Sheets, ADeckOverARoadIsOne) {
  Random random(1);
  NodeCloud cloud;
  add(cloud, random, 6, 0);
  add(cloud, random, 10, 5'000, 0.05);
  const Looked seen = look(cloud);
  EXPECT_NEAR(seen.look.clearance_mm, 5'000, 40);
  ASSERT_EQ(seen.sheets.size(), 1u);
  const NodeSheet& deck = seen.sheets[0];
  EXPECT_NEAR(deck.above_mm, 5'000, 40);
  EXPECT_NEAR(deck.plane.slope_x / kSlopeUnit, 0.1, 0.05);
  EXPECT_NEAR(deck.plane.slope_y / kSlopeUnit, 0.05, 0.07);
  EXPECT_EQ(deck.plane.count, 10);
  EXPECT_LT(deck.plane.sd_mm, 25);
  EXPECT_NEAR(height_at_centre_mm(deck.plane), 15'000, 70);
}

TEST(Sheets, TwoDecksAndARoadBelow) {
  Random random(2);
  NodeCloud cloud;
  add(cloud, random, 8, -7'000);
  add(cloud, random, 8, 5'000);
  add(cloud, random, 8, 10'000);
  const Looked seen = look(cloud);
  ASSERT_EQ(seen.sheets.size(), 3u);
  EXPECT_NEAR(seen.sheets[0].above_mm, -7'000, 40);
  EXPECT_NEAR(seen.sheets[1].above_mm, 5'000, 40);
  EXPECT_NEAR(seen.sheets[2].above_mm, 10'000, 40);
}

TEST(Sheets, AreFoundUnderWhatStandsOnThem) {
  Random random(3);
  NodeCloud cloud;
  add(cloud, random, 10, 5'000);
  add(cloud, random, 6, 6'500);  // a car on the deck: less than room above it
  const Looked seen = look(cloud);
  ASSERT_EQ(seen.sheets.size(), 1u);
  EXPECT_NEAR(seen.sheets[0].above_mm, 5'000, 40);
  EXPECT_EQ(seen.sheets[0].plane.count, 10);
}

TEST(Sheets, ATreeHasHardlyAny) {
  Random random(4);
  std::size_t found = 0;
  for (int round = 0; round < 200; ++round) {
    NodeCloud cloud;
    add(cloud, random, 5, 0);
    add(cloud, random, 25, 5'000, 0, 3'000);
    found += look(cloud).sheets.size();
  }
  EXPECT_LE(found, 20u) << "of 200 nodes";
}

TEST(Sheets, NeedThreePoints) {
  Random random(5);
  NodeCloud cloud;
  add(cloud, random, 2, 5'000);
  EXPECT_TRUE(look(cloud).sheets.empty());
  add(cloud, random, 1, 5'000);
  EXPECT_EQ(look(cloud).sheets.size(), 1u);
}

TEST(Sheets, DoNotDependOnTheOrderOfPoints) {
  Random random(6);
  for (int round = 0; round < 100; ++round) {
    NodeCloud cloud;
    add(cloud, random, 5, 0);
    add(cloud, random, 6, 4'000, 0.3);
    add(cloud, random, 5, 7'000, 0, 900);
    const Looked there = look(cloud), back = look(cloud.reversed());
    ASSERT_EQ(there.sheets.size(), back.sheets.size());
    for (std::size_t i = 0; i < there.sheets.size(); ++i)
      EXPECT_EQ(std::memcmp(&there.sheets[i], &back.sheets[i], sizeof(NodeSheet)), 0);
  }
}

TEST(SurfaceNode, LiesOnThePlane) {
  const LevelNode n = surface_node(kEast, kSurface, kR_mm);
  EXPECT_EQ(n.mean_x_mm, 667);
  EXPECT_EQ(n.mean_z_mm, 10'067);
  EXPECT_EQ(height_at_centre_mm(n), 10'000);
}

}  // namespace
}  // namespace btms::test
