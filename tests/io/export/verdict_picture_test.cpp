// The picture of right and wrong points: places, colours, what lies above what.
#include "io/export/verdict_picture.h"

#include <algorithm>

#include "tests/io/export/read_png.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

const Rgb kTerrainColour = verdict_colour(Verdict::kTerrain), kObjectColour = verdict_colour(Verdict::kObject),
          kTypeOneColour = verdict_colour(Verdict::kTypeOne), kTypeTwoColour = verdict_colour(Verdict::kTypeTwo);

// 400 m x 100 m, a point a metre: 4 pixels a metre.
constexpr PlanBox kField{-200'000, 50'000, 200'000, 150'000};
constexpr std::int64_t kPoints = 400 * 100;

void draw_terrain(VerdictPicture& picture, const PlanBox& box) {
  for (std::int64_t y = box.y0_mm + 500; y < box.y1_mm; y += 1000)
    for (std::int64_t x = box.x0_mm + 500; x < box.x1_mm; x += 1000) picture.draw(x, y, Verdict::kTerrain);
}

Picture written(const VerdictPicture& picture) {
  const TemporaryFolder temporary;
  picture.write_png(temporary / "a.png");
  return read_png(temporary / "a.png");
}

TEST(VerdictPicture, NorthIsUpAndVerdictsHaveTheirColours) {
  VerdictPicture drawing(kField, kPoints);
  draw_terrain(drawing, kField);
  drawing.draw(-100'000, 140'000, Verdict::kObject);
  drawing.draw(100'000, 140'000, Verdict::kTypeOne);
  drawing.draw(100'000, 60'000, Verdict::kTypeTwo);
  drawing.draw(-100'000, 60'000, Verdict::kLeftOut);
  const Picture p = written(drawing);
  EXPECT_EQ(p.width(), 1600);
  EXPECT_GE(p.height(), 400);
  EXPECT_LT(p.height(), 500);
  EXPECT_EQ(p.at(400, 39), kObjectColour);
  EXPECT_EQ(p.at(1200, 39), kTypeOneColour);
  EXPECT_EQ(p.at(1200, 359), kTypeTwoColour);
  EXPECT_EQ(p.at(400, 359), kTerrainColour);
  EXPECT_EQ(p.at(2, 2), kTerrainColour);
  EXPECT_EQ(p.at(1597, 397), kTerrainColour);
}

TEST(VerdictPicture, ErrorsLieAboveTheRestInAnyOrder) {
  std::vector<Verdict> order{Verdict::kTerrain, Verdict::kObject, Verdict::kTypeOne, Verdict::kTypeTwo};
  do {
    VerdictPicture drawing(kField, kPoints);
    for (const Verdict v : order) {
      drawing.draw(0, 100'000, v);
      if (v <= Verdict::kTypeOne) drawing.draw(50'000, 100'000, v);
      if (v <= Verdict::kObject) drawing.draw(-50'000, 100'000, v);
    }
    const Picture p = written(drawing);
    EXPECT_EQ(p.at(800, 199), kTypeTwoColour);
    EXPECT_EQ(p.at(1000, 199), kTypeOneColour);
    EXPECT_EQ(p.at(600, 199), kObjectColour);
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(VerdictPicture, AnErrorAmongMillionsIsThreePixelsWide) {
  constexpr PlanBox kBox{0, 0, 1'600'000, 1'000'000};
  VerdictPicture drawing(kBox, 50'000'000);
  drawing.draw(800'500, 500'500, Verdict::kTypeOne);
  drawing.draw(400'500, 500'500, Verdict::kTerrain);
  const Picture p = written(drawing);
  int errors = 0, right = 0;
  for (int y = 0; y < 1000; ++y)
    for (int x = 0; x < p.width(); ++x) {
      errors += p.at(x, y) == kTypeOneColour;
      right += p.at(x, y) == kTerrainColour;
    }
  EXPECT_EQ(errors, 9);
  EXPECT_EQ(right, 1);
}

TEST(VerdictPicture, WhatLiesOutsideOfTheBoxIsNotDrawn) {
  VerdictPicture drawing(kField, kPoints);
  for (const std::int64_t far : {std::int64_t{200'000}, std::int64_t{1} << 36}) {
    drawing.draw(far, 100'000, Verdict::kTypeTwo);
    drawing.draw(-far - 1, 100'000, Verdict::kTypeTwo);
    drawing.draw(0, far, Verdict::kTypeTwo);
  }
  drawing.draw(0, 49'999, Verdict::kTypeTwo);
  const Picture p = written(drawing);
  for (int y = 0; y < 400; ++y)
    for (int x = 0; x < p.width(); ++x) ASSERT_EQ(p.at(x, y), Rgb{}) << x << ' ' << y;
}

TEST(VerdictPicture, ALegendNamesTheColours) {
  VerdictPicture drawing({0, 0, 20'000, 20'000}, 400);
  const Picture p = written(drawing);
  EXPECT_GT(p.width(), 5 * 20);  // wider than what is drawn
  for (const Rgb colour : {kTerrainColour, kObjectColour, kTypeOneColour, kTypeTwoColour}) {
    bool found = false;
    for (int y = 0; y < p.height(); ++y)
      for (int x = 0; x < p.width(); ++x) found = found || p.at(x, y) == colour;
    EXPECT_TRUE(found);
  }
  for (int y = 0; y < p.height(); ++y) EXPECT_EQ(p.at(p.width() - 1, y), Rgb{}) << y;  // nothing is cut off
}

TEST(VerdictPicture, LargeTinyAndThinBoxesFit) {
  for (const PlanBox& box : {PlanBox{0, 0, 1, 1}, PlanBox{0, 0, 30'000'000, 1}, PlanBox{-5, 0, 5, 900'000},
                             PlanBox{-(std::int64_t{1} << 36), -5, std::int64_t{1} << 36, 1000}})
    for (const std::uint32_t limit : {0u, 100u, 640u, 1600u})
      for (const std::uint64_t points : {0ull, 1ull, 1'000'000'000'000ull}) {
        VerdictPicture drawing(box, points, limit);
        drawing.draw(box.x0_mm, box.y0_mm, Verdict::kTypeOne);
        drawing.draw(box.x1_mm - 1, box.y1_mm - 1, Verdict::kTypeOne);
        const Picture p = written(drawing);
        EXPECT_LE(p.width(), static_cast<int>(std::max(limit, 64u)));
        EXPECT_LE(p.height(), static_cast<int>(std::max(limit, 64u)));
      }
  const VerdictPicture drawing(kField, kPoints);
  EXPECT_EQ(thrown_code([&] { drawing.write_png("/no/such/folder/a.png"); }), ErrorCode::kFailed);
}

}  // namespace
}  // namespace btms
