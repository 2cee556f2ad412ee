// What a scene says of a place, against its own points and the other questions it answers.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

#include "engine/scenes/scene.h"

namespace btms {
namespace {

// Places all over a scene, and what is true there.
struct Survey {
  std::unique_ptr<Scene> scene;
  std::vector<ScenePlace> places;
  std::vector<PlaceTruth> truths;
  std::map<Stratum, std::size_t> count;

  explicit Survey(const std::string& name, std::uint64_t points = 1'000'000, std::uint64_t seed = 1) {
    scene = Scene::create({.name = name, .seed = seed, .points = points});
    for (double y = 0.3; y < scene->height_m(); y += 1.1)
      for (double x = 0.7; x < scene->width_m(); x += 1.1) places.push_back({x, y});
    truths.resize(places.size());
    scene->truth(places, truths);
    for (const PlaceTruth& t : truths) ++count[t.stratum];
  }
  double share(Stratum s) { return static_cast<double>(count[s]) / static_cast<double>(places.size()); }
};

class TruthOf : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Scenes, TruthOf, testing::ValuesIn(Scene::names()),
                         [](const auto& scene) { return scene.param; });

TEST_P(TruthOf, IsTheSameOneByOneAndAgreesWithTheScene) {
  const Survey s(GetParam(), 100'000);
  for (std::size_t i = 0; i < s.places.size(); i += 13) {
    const auto& [x, y] = s.places[i];
    const PlaceTruth one = s.scene->truth(x, y), &many = s.truths[i];
    EXPECT_EQ(one.stratum, many.stratum) << x << ", " << y;
    EXPECT_EQ(one.upper_z_m, many.upper_z_m);
    EXPECT_EQ(one.cover, many.cover);
    EXPECT_EQ(one.at_step, many.at_step);
    EXPECT_EQ(many.ground_z_m, s.scene->ground_z_m(x, y));
    EXPECT_EQ(many.cover, s.scene->cover(x, y));
    EXPECT_EQ(many.upper_z_m, s.scene->upper_z_m(x, y));
    EXPECT_EQ(many.stratum, s.scene->stratum(x, y));
  }
}

TEST_P(TruthOf, StrataFollowFromTheCover) {
  const Survey s(GetParam(), 200'000);
  for (const PlaceTruth& t : s.truths) {
    if (t.upper_z_m) {
      EXPECT_EQ(t.stratum, Stratum::kUnderBridge);
      EXPECT_GT(*t.upper_z_m, t.ground_z_m + 0.5);
    }
    switch (t.stratum) {
      case Stratum::kUnderBuilding:  // a crown may hang over it
        EXPECT_TRUE(t.cover == SceneClass::kBuilding || t.cover == SceneClass::kHighVegetation ||
                    t.cover == SceneClass::kLowVegetation || t.cover == SceneClass::kUnclassified);
        break;
      case Stratum::kOpen:
      case Stratum::kBehindWall:
        EXPECT_EQ(t.cover, SceneClass::kGround);
        break;
      case Stratum::kUnderPlants:
        EXPECT_TRUE(t.cover == SceneClass::kLowVegetation || t.cover == SceneClass::kHighVegetation);
        break;
      default:
        break;
    }
  }
}

TEST_P(TruthOf, DeckPointsLieOnTheUpperSurface) {
  const auto scene = Scene::create({.name = GetParam(), .points = 300'000});
  std::size_t far = 0, decks = 0;
  for (std::size_t b = 0; b < scene->blocks(); ++b) {
    std::vector<ScenePoint> points;
    scene->generate(b, points);
    for (const ScenePoint& p : points) {
      if (p.label != SceneClass::kBridgeDeck || p.x_mm % 3 != 0) continue;
      const PlaceTruth t = scene->truth(static_cast<double>(p.x_mm) / 1000, static_cast<double>(p.y_mm) / 1000);
      if (!t.upper_z_m) continue;  // its end
      ++decks;
      far += std::abs(p.z_mm / 1000.0 - *t.upper_z_m) > 0.15;
    }
  }
  EXPECT_LE(far, decks / 20);  // the sides of decks
  EXPECT_EQ(decks > 0, GetParam() == "city" || GetParam() == "overpass");
}

TEST(Truth, TheCityHasEveryStratum) {
  Survey city("city");
  for (std::size_t k = 0; k < kStrata; ++k)
    EXPECT_GT(city.count[static_cast<Stratum>(k)], city.places.size() / 1000) << "stratum " << k;
}

TEST(Truth, WallsAreStepsAndSlopesAndKerbsAreNot) {
  const auto at_steps = [](const char* name) {
    const Survey s(name);
    std::size_t steps = 0;
    for (const PlaceTruth& t : s.truths) steps += t.at_step;
    return static_cast<double>(steps) / static_cast<double>(s.places.size());
  };
  EXPECT_LT(at_steps("hills"), 1e-5);
  EXPECT_LT(at_steps("forest"), 1e-4);
  EXPECT_GT(at_steps("quarry"), 0.01);  // cliffs
  EXPECT_LT(at_steps("city"), 0.02);    // terraces in parks
  EXPECT_EQ(at_steps("indoor"), 0);
}

// Where a scene says that the ground is in the shadow, its points have left it out.
TEST(Truth, SlantedPulsesDoNotReachWhatIsBehindAWall) {
  for (const char* name : {"halls", "hillside", "overpass"}) {
    const auto scene = Scene::create({.name = name, .points = 300'000});
    std::map<Stratum, std::pair<std::size_t, std::size_t>> ground;  // of ground points, of places
    for (std::size_t b = 0; b < scene->blocks(); ++b) {
      std::vector<ScenePoint> points;
      scene->generate(b, points);
      std::vector<ScenePlace> places;
      for (const ScenePoint& p : points)
        if (p.label == SceneClass::kGround)
          places.push_back({static_cast<double>(p.x_mm) / 1000, static_cast<double>(p.y_mm) / 1000});
      std::vector<PlaceTruth> truths(places.size());
      scene->truth(places, truths);
      for (const PlaceTruth& t : truths) ground[t.stratum].first += !t.at_step;
    }
    Survey s(name, 300'000);
    const double per_place = 10 * 1.1 * 1.1;  // pulses
    for (const PlaceTruth& t : s.truths) ground[t.stratum].second += !t.at_step;
    const auto reached = [&](Stratum k) {
      return static_cast<double>(ground[k].first) / (per_place * static_cast<double>(ground[k].second) + 1);
    };
    EXPECT_GT(reached(Stratum::kOpen), 0.95) << name;
    EXPECT_LT(reached(Stratum::kBehindWall), 0.1) << name;
    EXPECT_LT(reached(Stratum::kUnderBuilding), 0.01) << name;
    EXPECT_GT(ground[Stratum::kBehindWall].second, 50u) << name;
  }
}

TEST(Truth, CliffsAndHousesCastTheirShadows) {
  EXPECT_GT(Survey("quarry").share(Stratum::kBehindWall), 0.001);
  EXPECT_GT(Survey("city").share(Stratum::kBehindWall), 0.01);
  EXPECT_LT(Survey("bumpy").share(Stratum::kBehindWall), 0.02);
}

}  // namespace
}  // namespace btms
