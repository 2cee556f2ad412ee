#include "engine/scenes/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "engine/error.h"
#include "engine/scenes/random.h"

namespace btms {
namespace {

SceneOptions options(const std::string& name, std::uint64_t points = 200'000, double density = 10) {
  return {.name = name, .seed = 7, .density_per_m2 = density, .points = points};
}

std::vector<ScenePoint> block_of(const Scene& scene, std::size_t block) {
  std::vector<ScenePoint> points;
  scene.generate(block, points);
  return points;
}

// Sum of hashes: the same for any order of the points.
std::uint64_t fingerprint(const std::vector<ScenePoint>& points, std::int64_t dx_mm = 0, std::int64_t dy_mm = 0) {
  std::uint64_t sum = 0;
  for (const ScenePoint& p : points)
    sum += hash_at(hash_at(1, p.x_mm - dx_mm, p.y_mm - dy_mm), p.z_mm, static_cast<std::int64_t>(p.label));
  return sum;
}

std::uint64_t fingerprint(const Scene& scene, std::int64_t dx_mm = 0, std::int64_t dy_mm = 0) {
  std::uint64_t sum = 0;
  for (std::size_t b = 0; b < scene.blocks(); ++b) sum += fingerprint(block_of(scene, b), dx_mm, dy_mm);
  return sum;
}

class EveryScene : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Scenes, EveryScene, testing::ValuesIn(Scene::names()),
                         [](const auto& scene) { return scene.param; });

TEST_P(EveryScene, BlocksDoNotDependOnOrderOrThreads) {
  const auto scene = Scene::create(options(GetParam()));
  ASSERT_GT(scene->blocks(), 1u);
  std::uint64_t backwards = 0;
  std::thread other([&] {
    for (std::size_t b = scene->blocks(); b-- > 0;) backwards += fingerprint(block_of(*scene, b));
  });
  const std::uint64_t forwards = fingerprint(*scene);
  other.join();
  EXPECT_EQ(forwards, backwards);
  EXPECT_EQ(forwards, fingerprint(*Scene::create(options(GetParam()))));
}

TEST_P(EveryScene, GenerateAppends) {
  const auto scene = Scene::create(options(GetParam(), 50'000));
  std::vector<ScenePoint> both{ScenePoint{1, 2, 3, SceneClass::kGround}};
  scene->generate(0, both);
  EXPECT_EQ(both.front().z_mm, 3);
  EXPECT_EQ(both.size(), block_of(*scene, 0).size() + 1);
}

TEST_P(EveryScene, SeedsDiffer) {
  SceneOptions o = options(GetParam(), 20'000);
  const std::uint64_t seven = fingerprint(*Scene::create(o));
  o.seed = 8;
  EXPECT_NE(seven, fingerprint(*Scene::create(o)));
}

TEST_P(EveryScene, AnOriginMovesTheSamePoints) {
  SceneOptions o = options(GetParam());
  const auto here = Scene::create(o);
  o.origin_x_m = 692'123.457;
  o.origin_y_m = -5'336'000.001;
  const auto there = Scene::create(o);
  EXPECT_EQ(fingerprint(*here), fingerprint(*there, 692'123'457, -5'336'000'001));
  for (int k = 0; k < 2000; ++k) {
    const int x_mm = 37 * k % 140'000, y_mm = 7919 * k % 140'000;
    const double a = here->ground_z_m(x_mm / 1000.0, y_mm / 1000.0);
    const double b =
        there->ground_z_m((692'123'457 + std::int64_t{x_mm}) / 1000.0, (-5'336'000'001 + std::int64_t{y_mm}) / 1000.0);
    ASSERT_EQ(a, b);
  }
}

TEST_P(EveryScene, GroundPointsLieOnTheGround) {
  const auto scene = Scene::create(options(GetParam(), 300'000));
  double square = 0, mean = 0;
  std::size_t count = 0;
  for (std::size_t b = 0; b < scene->blocks(); ++b)
    for (const ScenePoint& p : block_of(*scene, b)) {
      const double x = static_cast<double>(p.x_mm) / 1000, y = static_cast<double>(p.y_mm) / 1000;
      const double above = p.z_mm / 1000.0 - scene->ground_z_m(x, y);
      if (p.label == SceneClass::kLowNoise) {
        EXPECT_LT(above, -0.4);
        EXPECT_GT(above, -5.1);
      } else if (p.label == SceneClass::kGround) {
        ASSERT_LT(std::abs(above), 5 * scene->ground_deviation_m()) << "at " << x << ", " << y;
        square += above * above;
        mean += above;
        ++count;
      } else {
        ASSERT_GT(above, -0.1) << "at " << x << ", " << y;
      }
    }
  ASSERT_GT(count, 0u);
  EXPECT_NEAR(std::sqrt(square / static_cast<double>(count)), scene->ground_deviation_m(), 0.001);
  EXPECT_NEAR(mean / static_cast<double>(count), 0, 0.0005);
}

TEST_P(EveryScene, HasTheDensityAndAreaAskedFor) {
  for (const double density : {0.5, 10.0, 60.0}) {
    const auto scene = Scene::create(options(GetParam(), 150'000, density));
    std::size_t count = 0;
    for (std::size_t b = 0; b < scene->blocks(); ++b) {
      for (const ScenePoint& p : block_of(*scene, b)) {
        ASSERT_TRUE(p.x_mm >= 0 && static_cast<double>(p.x_mm) < 1000 * scene->width_m());
        ASSERT_TRUE(p.y_mm >= 0 && static_cast<double>(p.y_mm) < 1000 * scene->height_m());
        ++count;
      }
    }
    EXPECT_NEAR(static_cast<double>(count), 150'000, 0.02 * 150'000);
    EXPECT_NEAR(scene->width_m() * scene->height_m() * density, 150'000, 150);
  }
}

TEST_P(EveryScene, BlocksAreInScanLineOrder) {
  const auto scene = Scene::create(options(GetParam()));
  const auto points = block_of(*scene, 0);
  const double line_mm = 1000 / std::sqrt(10.0);
  std::int64_t highest_mm = 0;
  for (const ScenePoint& p : points) {
    highest_mm = std::max(highest_mm, p.y_mm);
    ASSERT_GT(static_cast<double>(p.y_mm), static_cast<double>(highest_mm) - 1.05 * line_mm);
  }
}

TEST_P(EveryScene, TheCoverExplainsThePoints) {
  const auto scene = Scene::create(options(GetParam()));
  std::size_t open = 0, agree = 0;
  for (std::size_t b = 0; b < scene->blocks(); ++b) {
    const auto points = block_of(*scene, b);
    for (std::size_t i = 0; i < points.size(); i += 23) {
      const ScenePoint& p = points[i];
      const SceneClass cover = scene->cover(static_cast<double>(p.x_mm) / 1000, static_cast<double>(p.y_mm) / 1000);
      if (p.label == SceneClass::kGround) {
        // Solid things hide the ground.
        ASSERT_NE(cover, SceneClass::kBuilding);
        ASSERT_NE(cover, SceneClass::kVehicle);
        if (GetParam() != "overpass") {  // scanned from below too
          ASSERT_NE(cover, SceneClass::kBridgeDeck);
        }
      }
      if (cover == SceneClass::kGround) {
        ++open;
        if (p.label == SceneClass::kGround || p.label == SceneClass::kCeiling) ++agree;
      }
    }
  }
  // The rest are walls met by slanted pulses, and noise.
  EXPECT_GT(static_cast<double>(agree), 0.97 * static_cast<double>(open));
}

// The same bits from every compiler and at every optimisation level. A change here changes every published figure.
TEST(Scene, PointsAreTheSameOnEveryMachine) {
  EXPECT_EQ(fingerprint(*Scene::create(options("city"))), 0x55c9c93e2b02d8f3u);
  EXPECT_EQ(fingerprint(*Scene::create(options("hills"))), 0xdc5cc25ce166064eu);
  EXPECT_EQ(fingerprint(*Scene::create(options("quarry"))), 0x0d8954dfff896a26u);
  EXPECT_EQ(fingerprint(*Scene::create(options("bumpy"))), 0xc194cf0b7e5d5999u);
  EXPECT_EQ(fingerprint(*Scene::create(options("indoor"))), 0x602a17a290723d19u);
  EXPECT_EQ(fingerprint(*Scene::create(options("forest"))), 0x2d95f9100ddc33afu);
  EXPECT_EQ(fingerprint(*Scene::create(options("halls"))), 0xa8254fb1a547a241u);
  EXPECT_EQ(fingerprint(*Scene::create(options("hillside"))), 0xccc2f079456c6d11u);
  EXPECT_EQ(fingerprint(*Scene::create(options("overpass"))), 0x53ed35b427a5dc5cu);
}

TEST(Scene, TinyAndThinMapsWork) {
  for (const std::string& name : Scene::names()) {
    EXPECT_EQ(block_of(*Scene::create(options(name, 1)), 0).size(), 1u);
    const auto scene = Scene::create(options(name, 41'000, 10));  // a border block a few centimetres wide
    EXPECT_EQ(scene->blocks(), 4u);
    std::size_t count = 0;
    for (std::size_t b = 0; b < 4; ++b) count += block_of(*scene, b).size();
    EXPECT_NEAR(static_cast<double>(count), 41'000, 500);
  }
}

TEST(Scene, BadOptionsAreUsageErrors) {
  const auto code = [](const SceneOptions& o) {
    try {
      Scene::create(o);
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kUsage);
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_THAT(code(options("atlantis")), testing::AllOf(testing::HasSubstr("atlantis"), testing::HasSubstr("quarry")));
  EXPECT_NE(code(options("city", 0)), "");
  EXPECT_NE(code(options("city", 10, 0)), "");
  EXPECT_NE(code(options("city", 10, std::nan(""))), "");
  SceneOptions far = options("city");
  far.origin_x_m = 1e9;
  EXPECT_NE(code(far), "");
}

}  // namespace
}  // namespace btms
