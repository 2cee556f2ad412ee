#include "io/export/terrarium.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/io/export/read_png.h"

namespace btms {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

double height_of(Rgb c) { return c.r * 256.0 + c.g + c.b / 256.0 - 32768; }

TEST(Terrarium, ColoursAreHeights) {
  const std::vector<double> heights = {0, -0.25, 8848.86, -430.5, 32767.99, -32768, 1e9, -1e9};
  const Picture pixels = read_png(terrarium_png(4, 2, heights));
  ASSERT_EQ(pixels.width() * pixels.height(), 8);
  for (int i = 0; i < 6; ++i)
    EXPECT_NEAR(height_of(pixels.at(i % 4, i / 4)), heights[static_cast<std::size_t>(i)], 1.0 / 512 + 1e-9) << i;
  EXPECT_GT(height_of(pixels.at(2, 1)), 32767);
  EXPECT_EQ(height_of(pixels.at(3, 1)), -32768);
}

TEST(Terrarium, HolesTakeTheNearestHeight) {
  const std::vector<double> heights = {kNan, kNan, kNan, kNan, kNan,  //
                                       kNan, 3,    kNan, kNan, 7,     //
                                       kNan, kNan, kNan, kNan, kNan,  //
                                       kNan, kNan, 1,    kNan, kNan};
  const Picture pixels = read_png(terrarium_png(5, 4, heights));
  const double wanted[] = {3, 3, 3, 7, 7, 3, 3, 3, 7, 7, 3, 3, 3, 7, 7, 1, 1, 1, 1, 1};
  for (int i = 0; i < 20; ++i) EXPECT_EQ(height_of(pixels.at(i % 5, i / 5)), wanted[i]) << i;
  EXPECT_TRUE(terrarium_png(2, 1, {kNan, kNan}).empty());
}

}  // namespace
}  // namespace btms
