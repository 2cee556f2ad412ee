// Bridges and what only looks like one, as heights of squares of 2 m.
#include "engine/terrain/span.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "engine/terrain/parameters.h"

namespace btms::test {
namespace {

const SpanRules kRules(preset("city"), 2000);
constexpr CellBox kBox{0, 0, 40, 40};
constexpr std::int32_t kDeck_mm = 16'000, kRoad_mm = 10'000;

// z(x, y) in millimetres for metres from the middle of the box; kUnknownHeight_mm where nothing is known.
using World = std::function<std::int32_t(double, double)>;

std::vector<SpanGround> spans_of(const World& world) {
  const CellBox held = kBox.grown(kRules.halo());
  std::vector<SquareHeights> heights;
  for (std::int32_t row = held.row0; row < held.row1; ++row)
    for (std::int32_t col = held.col0; col < held.col1; ++col) {
      const std::int32_t z = world(2 * col + 1 - 40, 2 * row + 1 - 40);
      heights.push_back(z == kUnknownHeight_mm ? SquareHeights{} : SquareHeights{z, z});
    }
  return find_spans(heights, kBox, kRules);
}

const SpanGround& at(const std::vector<SpanGround>& spans, double x_m, double y_m) {
  return spans[static_cast<std::size_t>((y_m + 40) / 2) * 40 + static_cast<std::size_t>((x_m + 40) / 2)];
}

std::size_t found(const std::vector<SpanGround>& spans) {
  return static_cast<std::size_t>(std::count_if(spans.begin(), spans.end(), [](const auto& s) { return s.known(); }));
}

std::int32_t mm(double m) { return static_cast<std::int32_t>(std::lround(m * 1000)); }

// A street at the deck's height crosses a cutting along y with sheer sides, 24 m wide, at an angle.
std::int32_t overpass(double x, double y, double lean, double grade) {
  const double across = (y - lean * x) / std::sqrt(1 + lean * lean);
  return std::abs(x) > 12 || std::abs(across) < 6 ? kDeck_mm : kRoad_mm + mm(grade * y);
}

TEST(Spans, ADeckOverARoadIsOne) {
  for (const double lean : {0.0, 0.2, 0.5, -0.7}) {
    const auto spans = spans_of([&](double x, double y) { return overpass(x, y, lean, 0); });
    for (double x = -9; x < 10; x += 2)
      for (double y = -3; y <= 3; y += 2) {
        const SpanGround& ground = at(spans, x, y + lean * x);
        ASSERT_TRUE(ground.known()) << lean << ": " << x << ' ' << y;
        EXPECT_EQ(ground.z_mm, kRoad_mm);
        EXPECT_EQ(ground.sd_mm, 0);
      }
    EXPECT_FALSE(at(spans, 21, lean * 21).known()) << "the street beyond the abutment stays";
    EXPECT_FALSE(at(spans, 0, 31).known()) << "so does the road";
  }
}

TEST(Spans, TheRoadBelowMayClimb) {
  const auto spans = spans_of([](double x, double y) { return overpass(x, y, 0, 0.05); });
  ASSERT_TRUE(at(spans, 1, 1).known());
  EXPECT_NEAR(at(spans, 1, 1).z_mm, kRoad_mm + 50, 20);
  EXPECT_NEAR(at(spans, 1, -5).z_mm, kRoad_mm - 250, 20);
  EXPECT_GT(at(spans, 1, 1).sd_mm, 200) << "half of what it climbs from foot to foot";
}

TEST(Spans, ADeckWiderThanTheLimitIsKept) {
  const auto spans =
      spans_of([](double x, double y) { return std::abs(x) > 30 || std::abs(y) < 16 ? kDeck_mm : kRoad_mm; });
  EXPECT_EQ(found(spans), 0u);
}

TEST(Spans, AnEmbankmentIsKept) {
  for (const double run : {1.5, 2.0, 3.0})  // metres out for one down
    for (const double lean : {0.0, 0.3}) {
      const auto spans = spans_of([&](double x, double y) {
        const double out = std::abs(y - lean * x) / std::sqrt(1 + lean * lean) - 5;
        return kDeck_mm - mm(std::clamp(out / run, 0.0, 6.0));
      });
      EXPECT_EQ(found(spans), 0u) << "1 in " << run << ", leaning " << lean;
    }
}

TEST(Spans, ATerraceIsKept) {
  const auto spans = spans_of([](double, double y) { return y > 8 ? kDeck_mm + 6'000 : y > -8 ? kDeck_mm : kRoad_mm; });
  EXPECT_EQ(found(spans), 0u);
}

TEST(Spans, AWallIsKept) {
  const auto spans = spans_of([](double, double y) { return std::abs(y - 1) < 1 ? kDeck_mm : kRoad_mm; });
  EXPECT_EQ(found(spans), 0u) << "one square is no strip";
}

TEST(Spans, ARidgeIsKept) {
  const auto spans = spans_of([](double, double y) { return kDeck_mm - mm(std::min(6.0, std::abs(y) * 0.9)); });
  EXPECT_EQ(found(spans), 0u);
}

TEST(Spans, APodiumBetweenAStreetAndAPitIsKept) {
  // Both below it, but not on one level: nothing passes under it.
  const auto spans = spans_of([](double, double y) {
    return std::abs(y) < 6 ? kDeck_mm : y < 0 ? kRoad_mm : kRoad_mm + 700;
  });
  EXPECT_EQ(found(spans), 0u);
}

TEST(Spans, WithoutGroundOnBothSidesNothingIsKnown) {
  const auto spans = spans_of([](double, double y) { return std::abs(y) < 6 ? kDeck_mm : kUnknownHeight_mm; });
  EXPECT_EQ(found(spans), 0u);
}

TEST(SquareHeightsOf, TheGroundIsTheMeanOfTheLowNodes) {
  const std::vector<std::int32_t> nodes = {10'000, 10'300, kUnknownHeight_mm, 16'000};
  const SquareHeights h = square_heights(nodes, kRules);
  EXPECT_EQ(h.low_mm, 10'150);
  EXPECT_EQ(h.high_mm, 16'000);
  EXPECT_FALSE(square_heights(std::vector<std::int32_t>(4, kUnknownHeight_mm), kRules).known());
}

}  // namespace
}  // namespace btms::test
