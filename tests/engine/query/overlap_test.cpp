// Shapes over the triangles of a square, against overlap the long way.
#include "engine/query/overlap.h"

#include <gtest/gtest.h>

#include "tests/engine/query/plane_shapes.h"
#include "tests/support/cloud.h"

namespace btms::test {
namespace {

constexpr std::int64_t kHalf = 3;

template <class Meets>
TriangleMask expected(const Meets& meets) {
  TriangleMask mask = 0;
  for (std::uint8_t t = 0; t < kTriangles; ++t)
    mask |= static_cast<TriangleMask>(meets(triangle(t, {0, 0}, kHalf)) << t);
  return mask;
}

TEST(Overlap, DiscsExhaustive) {
  for (std::int64_t x = -12; x <= 12; ++x)
    for (std::int64_t y = -12; y <= 12; ++y)
      for (std::int64_t reach = 0; reach <= 18; ++reach)
        ASSERT_EQ(triangles_on_disc({x, y}, reach, kHalf), expected([&](const auto& corners) {
                    return disc_meets(corners, {x, y}, reach);
                  }))
            << x << " " << y << " " << reach;
}

TEST(Overlap, SegmentsExhaustive) {
  for (std::int64_t ax = -5; ax <= 5; ++ax)
    for (std::int64_t ay = -5; ay <= 5; ++ay)
      for (std::int64_t bx = -5; bx <= 5; ++bx)
        for (std::int64_t by = -5; by <= 5; ++by)
          ASSERT_EQ(triangles_on_segment({ax, ay}, {bx, by}, kHalf), expected([&](const auto& corners) {
                      return polygons_meet(corners, {{ax, ay}, {bx, by}});
                    }))
              << ax << " " << ay << " " << bx << " " << by;
}

// Also concave ones, those without an area, and those that cross themselves.
TEST(Overlap, Polygons) {
  Random random(11);
  int partly = 0;
  for (int round = 0; round < 40000; ++round) {
    std::vector<PlaceMm> polygon;
    for (std::int64_t n = random.between(3, 6); n > 0; --n)
      polygon.push_back({random.between(-9, 9), random.between(-9, 9)});
    const TriangleMask mask = triangles_on_polygon(
        polygon.size(), [&](std::size_t i) { return polygon[i]; }, kHalf);
    ASSERT_EQ(mask, expected([&](const auto& corners) { return polygons_meet(corners, polygon); })) << round;
    partly += mask != 0 && mask != kAllTriangles;
  }
  EXPECT_GT(partly, 4000);
}

// As far as places reach: products stay within 64 bits.
TEST(Overlap, GiantShapes) {
  constexpr std::int64_t kFar = std::int64_t{1} << 30;
  const PlaceMm square[] = {{-kFar, -kFar}, {kFar, -kFar}, {kFar, kFar}, {-kFar, kFar}};
  EXPECT_EQ(triangles_on_polygon(
                4, [&](std::size_t i) { return square[i]; }, 1000),
            kAllTriangles);
  EXPECT_EQ(triangles_on_segment({-kFar, -kFar}, {kFar, kFar}, 1000), kAllTriangles);
  EXPECT_EQ(triangles_on_segment({-kFar, 500}, {kFar, 500}, 1000), 1 << kEast | 1 << kNorth | 1 << kWest);
  EXPECT_EQ(triangles_on_disc({kFar, 0}, kFar - 1000, 1000), 1 << kEast);
  EXPECT_EQ(triangles_on_disc({kFar, 0}, kFar - 1001, 1000), 0);
}

}  // namespace
}  // namespace btms::test
