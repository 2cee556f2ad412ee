#include "engine/accumulation/voxel_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <tuple>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"

namespace btms {
namespace {

std::vector<LabelledPoint> random_points(std::size_t n) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> xy(-1000, 1000), z(-300, 300), kind(0, 4);
  std::vector<LabelledPoint> points;
  for (std::size_t i = 0; i < n; ++i)
    points.push_back(
        {400'000'000 + xy(random), -5'000'000'000 + xy(random), z(random), static_cast<std::uint32_t>(kind(random))});
  return points;
}

using Place = std::tuple<std::int64_t, std::int64_t, std::int32_t, std::uint32_t>;
std::vector<Place> places(VoxelMap& map) {
  std::vector<Place> out;
  map.for_each_voxel([&](const LabelledPoint& p) { out.emplace_back(p.x_mm, p.y_mm, p.z_mm, p.label); });
  return out;
}

TEST(VoxelMap, HoldsTheCentroidAndTheMajorityOfEachVoxel) {
  constexpr std::int64_t kEdge = 200;
  const auto points = random_points(5000);
  struct Sum {
    std::int64_t x = 0, y = 0, z = 0, n = 0;
    std::array<int, 5> votes{};
  };
  std::map<std::array<std::int64_t, 3>, Sum> sums;  // z, y, x
  for (const LabelledPoint& p : points) {
    Sum& s = sums[{floor_div(p.z_mm, kEdge), floor_div(p.y_mm, kEdge), floor_div(p.x_mm, kEdge)}];
    s.x += p.x_mm, s.y += p.y_mm, s.z += p.z_mm, ++s.n;
    ++s.votes[p.label];
  }
  VoxelMap map(kEdge);
  map.add(points);
  const auto found = places(map);
  ASSERT_EQ(found.size(), sums.size());
  std::size_t i = 0;
  for (const auto& [voxel, s] : sums) {
    const auto [x, y, z, label] = found[i++];
    const auto n = static_cast<double>(s.n);
    EXPECT_NEAR(static_cast<double>(x), static_cast<double>(s.x) / n, 0.5);
    EXPECT_NEAR(static_cast<double>(y), static_cast<double>(s.y) / n, 0.5);
    EXPECT_NEAR(static_cast<double>(z), static_cast<double>(s.z) / n, 0.5);
    EXPECT_EQ(label, std::max_element(s.votes.begin(), s.votes.end()) - s.votes.begin());  // the first of equals
  }
}

TEST(VoxelMap, DependsNeitherOnOrderNorOnPortions) {
  auto points = random_points(3000);
  VoxelMap whole(200), parts(200);
  whole.add(points);
  std::shuffle(points.begin() + 1, points.end(), std::mt19937(3));
  for (std::size_t i = 0; i < points.size(); i += 700)
    parts.add(std::span(points).subspan(i, std::min<std::size_t>(700, points.size() - i)));
  EXPECT_EQ(places(whole), places(parts));
}

TEST(VoxelMap, MergesPortionsIntoALargeMap) {
  VoxelMap whole(50), parts(50);
  const auto points = random_points(400'000);  // several merges
  whole.add(points);
  for (std::size_t i = 0; i < points.size(); i += 9000)
    parts.add(std::span(points).subspan(i, std::min<std::size_t>(9000, points.size() - i)));
  const auto found = places(parts);
  EXPECT_EQ(found, places(whole));
  EXPECT_EQ(found, places(parts)) << "asked again";
}

TEST(VoxelMap, RefusesPointsThatCannotBelongTogether) {
  VoxelMap map(10);
  const LabelledPoint near{0, 0, 0, 1}, far{11'000'000, 0, 0, 1};
  map.add({&near, 1});
  EXPECT_THROW(map.add({&far, 1}), Error);
}

}  // namespace
}  // namespace btms
