// Windows of a map, and their raw form.
#include "io/export/raster.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/error.h"
#include "engine/model/square_layers.h"
#include "engine/model/surface.h"
#include "io/export/raw_tile.h"
#include "tests/engine/query/query_map.h"

namespace btms {
namespace {

std::vector<const RasterLayer*> all_layers() {
  std::vector<const RasterLayer*> all;
  for (const RasterLayer& layer : raster_layers()) all.push_back(&layer);
  return all;
}

bool same(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

// What queries answer, on every level, at every square's centre.
TEST(Raster, AValueIsThatOfAQueryAtTheCentre) {
  const MemoryMap map = test::rolling_map(3);
  for (int level = 0; level <= 7; ++level) {
    const CellBox box{-3, -2, (60 >> level) + 2, (55 >> level) + 3};
    const Window window = cut_window(map, level, box, all_layers());
    ASSERT_EQ(window.cell_m, std::ldexp(2.0, level));
    int known = 0;
    for (std::size_t row = 0; row < window.rows; ++row)
      for (std::size_t col = 0; col < window.cols; ++col) {
        const double x = window.min_x_m + (static_cast<double>(col) + 0.5) * window.cell_m;
        const double y = window.max_y_m() - (static_cast<double>(row) + 0.5) * window.cell_m;
        const SurfacePoint s = surface_at(map, x, y);
        const float expected = s.state == NodeState::kUnknown ? NAN : static_cast<float>(s.z_m);
        ASSERT_TRUE(same(window.values[0][row * window.cols + col], expected))
            << "level " << level << " at " << x << " " << y;
        known += !std::isnan(expected);
      }
    EXPECT_EQ(known > 0, level < 7);
    EXPECT_EQ(window.empty(), known == 0);
  }
}

TEST(Raster, LevelNoughtHasTheLayersOfTheSquares) {
  const MemoryMap map = test::rolling_map(2);
  const auto tile = map.load({1, 0});
  const auto layers = all_layers();
  const Window window = cut_window(map, 0, tile->box, layers);
  const std::vector<float> upper = upper_elevations_m(*tile);
  for (std::size_t l = 0; l < layers.size(); ++l)
    for (std::size_t cell = 0; cell < upper.size(); ++cell) {
      const std::size_t cols = window.cols, row = window.rows - 1 - cell / cols;
      const float expected = layers[l]->square ? layers[l]->square(*tile, cell) : upper[cell];
      ASSERT_TRUE(same(window.values[l][row * cols + cell % cols], expected)) << layers[l]->name << " " << cell;
    }
}

TEST(Raster, SquaresOfAnyEdgeAreSampled) {
  const MemoryMap map = test::rolling_map(3);
  const RasterLayer* layers[] = {find_raster_layer("elevation"), find_raster_layer("cost")};
  const Window window = sample_window(map, -3.3, 7.1, 0.7, 90, 150, layers);
  const CellBox whole{0, 0, 48, 48};
  const Window squares = cut_window(map, 0, whole, layers);
  for (std::size_t row = 0; row < window.rows; ++row)
    for (std::size_t col = 0; col < window.cols; ++col) {
      const double x = -3.3 + (static_cast<double>(col) + 0.5) * 0.7;
      const double y = 7.1 + (static_cast<double>(window.rows - 1 - row) + 0.5) * 0.7;
      const SurfacePoint s = surface_at(map, x, y);
      const float expected = s.state == NodeState::kUnknown ? NAN : static_cast<float>(s.z_m);
      ASSERT_TRUE(same(window.values[0][row * window.cols + col], expected)) << x << " " << y;
      const auto square = [](double m) { return static_cast<std::size_t>(m / 2); };
      if (x >= 0 && x < 96 && y < 96) {
        ASSERT_TRUE(
            same(window.values[1][row * window.cols + col], squares.values[1][(47 - square(y)) * 48 + square(x)]));
      }
    }
  EXPECT_THROW(sample_window(map, 0, 0, 0, 1, 1, layers), Error);
  EXPECT_THROW(sample_window(map, NAN, 0, 1, 1, 1, layers), Error);
  EXPECT_THROW(sample_window(map, 0, 0, 1, 0, 1, layers), Error);
  EXPECT_THROW(sample_window(map, 0, 0, 1, 1ull << 40, 1ull << 40, layers), Error);
}

TEST(Raster, NoWindowIsTooLarge) {
  const MemoryMap map = test::rolling_map(1);
  const auto layers = all_layers();
  const auto refused = [&](int level, const CellBox& box) {
    try {
      cut_window(map, level, box, layers);
    } catch (const Error& e) {
      return e.code() == ErrorCode::kUsage;
    }
    return false;
  };
  constexpr std::int32_t kLow = std::numeric_limits<std::int32_t>::min(),
                         kHigh = std::numeric_limits<std::int32_t>::max();
  EXPECT_TRUE(refused(0, {0, 0, 4096, 4096}));
  EXPECT_TRUE(refused(0, {kLow, kLow, kHigh, kHigh}));
  EXPECT_TRUE(refused(0, {kHigh - 2, 0, kHigh, 2}));
  EXPECT_TRUE(refused(20, {1 << 20, 0, (1 << 20) + 1, 1}));
  EXPECT_TRUE(refused(0, {0, 0, 0, 5}));
  EXPECT_TRUE(refused(-1, {0, 0, 1, 1}));
  EXPECT_TRUE(refused(21, {0, 0, 1, 1}));
}

TEST(RawTile, ComesBack) {
  const MemoryMap map = test::rolling_map(2);
  const RasterLayer* layers[] = {find_raster_layer("slope"), find_raster_layer("class")};
  const Window window = cut_window(map, 1, {0, 0, 12, 9}, layers);
  std::vector<std::uint8_t> bytes = raw_tile(window, {3, -4});
  const RawHeader header = parse_raw_tile(bytes);
  EXPECT_EQ(header.layers, 2);
  EXPECT_EQ(header.level, 1);
  EXPECT_EQ(header.ty, -4);
  EXPECT_EQ(header.rows, 9u);
  EXPECT_EQ(header.cols, 12u);
  EXPECT_EQ(header.cell_m, 4);
  EXPECT_EQ(bytes.size(), 64 + 2 * 9 * 12 * 4u);
  for (const std::size_t at : {0, 8, 10, 12, 24, 28, 57, 70}) {
    std::vector<std::uint8_t> damaged = bytes;
    damaged[at] ^= 0x40;
    EXPECT_THROW(parse_raw_tile(damaged), Error) << at;
  }
  bytes.pop_back();
  EXPECT_THROW(parse_raw_tile(bytes), Error);
  EXPECT_THROW(parse_raw_tile({}), Error);
}

}  // namespace
}  // namespace btms
