// Drives against their scenes, by means that know nothing of how rays are cast.
#include "engine/scenes/drive.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "engine/error.h"
#include "engine/scenes/random.h"
#include "engine/scenes/slanted.h"
#include "engine/scenes/surroundings.h"

namespace btms {
namespace {

SceneOptions scene(const std::string& name, std::uint64_t points = 2'000'000) {
  return {.name = name, .seed = 3, .points = points};
}

DriveOptions small(std::size_t scans = 4) {
  DriveOptions o;
  o.scans = scans;
  o.beams = 24;
  o.azimuths = 180;
  return o;
}

std::vector<std::vector<DrivePoint>> all_scans(const Drive& drive) {
  std::vector<std::vector<DrivePoint>> scans(drive.poses().size());
  drive.scan(0, scans.size(), scans);
  return scans;
}

std::array<double, 3> in_map(const Drive& drive, std::size_t scan, const DrivePoint& p) {
  return drive.poses()[scan].to_map(
      {static_cast<double>(p.x_m), static_cast<double>(p.y_m), static_cast<double>(p.z_m)});
}

bool is_ground(std::uint32_t label) { return label == 40 || label == 72; }

// How far a height is from the ground within a few millimetres of a place: on the face of a step any height of it is
// the ground's.
double off_ground(const World& world, double x, double y, double z) {
  constexpr double kNear_m = 0.004;
  double low = world.ground_m(x, y), high = low;
  for (const double dx : {-kNear_m, 0.0, kNear_m})
    for (const double dy : {-kNear_m, 0.0, kNear_m}) {
      low = std::min(low, world.ground_m(x + dx, y + dy));
      high = std::max(high, world.ground_m(x + dx, y + dy));
    }
  return std::max(0.0, std::max(low - z, z - high));
}

// What is solid, told from the objects themselves.
class Solids {
 public:
  Solids(const World& world, const Box& box) : world_(world) {
    world.place(box, objects_);
    std::erase_if(objects_, [](const Object& o) {
      return o.label == SceneClass::kLowVegetation || (o.label == SceneClass::kHighVegetation && o.opacity < 1);
    });
  }
  // The object that a place in space is in, or none. `slack_m` shrinks it.
  const Object* at(double x, double y, double z, double slack_m) const {
    const double ground = world_.ground_m(x, y);
    for (const Object& o : objects_) {
      const Box b = o.bounds(-slack_m);
      if (x < b.x0_m || x > b.x1_m || y < b.y0_m || y > b.y1_m) continue;
      const auto top = absolute_top(o, x, y, ground);
      if (!top || *top < ground + 0.05 || z > *top - slack_m) continue;
      const double thickness = o.form == Form::kDeck ? kDeckThickness_m
                               : o.opacity < 1       ? std::max(o.scatter_m, 0.02)
                                                     : 1e9;
      if (z > std::max(ground, *top - thickness) + slack_m) return &o;
    }
    return nullptr;
  }

 private:
  const World& world_;
  std::vector<Object> objects_;
};

class EveryDrive : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Scenes, EveryDrive, testing::ValuesIn(Scene::names()),
                         [](const auto& name) { return name.param; });

TEST_P(EveryDrive, GroundLiesOnTheSurfaceAndThePosesTakeItThere) {
  const auto world = make_world(GetParam(), 3);
  const auto truth = Scene::create(scene(GetParam()));
  DriveOptions exact = small();
  exact.noise_m = 0;
  const Drive drive(scene(GetParam()), exact), noisy(scene(GetParam()), small());
  std::size_t ground = 0, points = 0;
  const auto scans = all_scans(drive), noisy_scans = all_scans(noisy);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    ASSERT_EQ(scans[i].size(), noisy_scans[i].size());
    for (std::size_t k = 0; k < scans[i].size(); ++k) {
      const DrivePoint &p = scans[i][k], &q = noisy_scans[i][k];
      const auto norm = [](const DrivePoint& d) { return std::hypot(std::hypot(d.x_m, d.y_m), d.z_m); };
      EXPECT_LT(std::abs(norm(p) - norm(q)), 0.02F * 3.5F + 1e-4F) << "noise is along the ray";
      EXPECT_LT(std::hypot(p.x_m * q.y_m - p.y_m * q.x_m, p.x_m * q.z_m - p.z_m * q.x_m), 0.002F * norm(p));
      EXPECT_LE(norm(p), 80.0F + 1e-3F);
      ++points;
      if (!is_ground(p.label)) continue;
      ++ground;
      const auto [x, y, z] = in_map(drive, i, p);
      if (off_ground(*world, x, y, z) < 0.002) continue;
      EXPECT_NEAR(truth->upper_z_m(x, y).value_or(-99), z, 0.01) << "neither ground nor bridge: " << x << ' ' << y;
    }
  }
  EXPECT_GT(ground, points / 20);
  EXPECT_GT(points, 4u * 24 * 180 / 3);
}

TEST_P(EveryDrive, NothingSolidLiesBeforeAReturnAndSomethingBehindIt) {
  const auto world = make_world(GetParam(), 3);
  constexpr double kRange_m = 40, kLook_m = 0.02, kNarrow_m = 0.22;
  const Drive drive(scene(GetParam()), small(40));
  std::map<std::string, int> met;
  for (const std::size_t i : {std::size_t{0}, std::size_t{17}, std::size_t{39}}) {
    const Pose& pose = drive.poses()[i];
    const auto& c = pose.place_m;
    const Box box{c[0] - kRange_m, c[1] - kRange_m, c[0] + kRange_m, c[1] + kRange_m};
    const Surroundings around(*world, box);
    const Solids solids(*world, box);
    Random random(i + 1);
    for (int n = 0; n < 150; ++n) {
      const double x = random.uniform(-1, 1), y = random.uniform(-1, 1), z = random.uniform(-0.5, 0.15);
      const double norm = std::sqrt(x * x + y * y + z * z);
      const Ray ray{c[0], c[1], c[2], x / norm, y / norm, z / norm};
      const auto at = [&](double t) {
        return std::array<double, 3>{ray.x_m + ray.dx * t, ray.y_m + ray.dy * t, ray.z_m + ray.dz * t};
      };
      const auto hit = around.first_hit(ray, kRange_m);
      const double end = hit ? hit->range_m : kRange_m;
      double in_since = -1, under_since = -1;  // longer than what a look along the ray may miss
      for (double t = 0.3; t < end - 0.01; t += kLook_m) {
        const auto [px, py, pz] = at(t);
        const Object* solid = solids.at(px, py, pz, 0.01);
        if (solid == nullptr)
          in_since = -1;
        else if (in_since < 0)
          in_since = t;
        if (pz > world->ground_m(px, py) - 0.005)
          under_since = -1;
        else if (under_since < 0)
          under_since = t;
        ASSERT_FALSE(solid != nullptr && t - in_since > kNarrow_m) << "passed something at " << t << " of " << end;
        ASSERT_FALSE(under_since >= 0 && t - under_since > 0.1) << "passed the ground at " << t << " of " << end;
      }
      if (!hit) {
        ++met["nothing"];
        continue;
      }
      const auto [px, py, pz] = at(hit->range_m);
      if (hit->object == nullptr) {
        ++met["ground"];
        EXPECT_LT(off_ground(*world, px, py, pz), 0.001);
      } else if (hit->object->opacity == 1 && hit->object->form != Form::kDeck) {
        ++met["solid"];
        // On its surface: not yet in it just before, in it just behind or in the next thing.
        const auto [bx, by, bz] = at(hit->range_m - 0.003);
        EXPECT_FALSE(hit->object->top(bx, by) && solids.at(bx, by, bz, 0.004) == hit->object);
        const auto top = absolute_top(*hit->object, px, py, world->ground_m(px, py));
        ASSERT_TRUE(top);
        EXPECT_LT(pz, *top + 0.002);
      } else if (hit->object->opacity < 1) {
        ++met["leaves"];
        const auto top = absolute_top(*hit->object, px, py, world->ground_m(px, py));
        ASSERT_TRUE(top);
        EXPECT_LE(pz, *top + 0.001);
        EXPECT_GE(pz, *top - std::max(hit->object->scatter_m, 0.02) - 0.001);
      }
    }
  }
  EXPECT_GT(met["ground"], 30);
  EXPECT_GT(met["solid"] + met["leaves"], 5);
}

TEST_P(EveryDrive, KeepsClearOfThingsAndStandsOnTheGround) {
  const auto world = make_world(GetParam(), 3);
  const Drive drive(scene(GetParam()), small(300));
  const auto truth = Scene::create(scene(GetParam()));
  std::vector<double> above;  // the wheels, above the ground
  for (std::size_t i = 0; i < drive.poses().size(); ++i) {
    const Pose& pose = drive.poses()[i];
    const auto& r = pose.rotation;
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b)
        EXPECT_NEAR(r[a] * r[b] + r[a + 3] * r[b + 3] + r[a + 6] * r[b + 6], a == b ? 1 : 0, 1e-12);
    EXPECT_GT(r[8], 0.7) << "upright";
    const auto [x, y, z] = pose.to_map({0, 0, -1.73});
    EXPECT_GT(x, truth->origin_x_m());
    EXPECT_LT(x, truth->origin_x_m() + truth->width_m());
    const double ground = truth->upper_z_m(x, y).value_or(world->ground_m(x, y));
    EXPECT_NEAR(z, ground, 1.2);  // a mound between the wheels
    above.push_back(z - ground);
    EXPECT_GT(pose.place_m[2], world->ground_m(pose.place_m[0], pose.place_m[1]) + 0.5);
    const Solids solids(*world, {x - 1, y - 1, x + 1, y + 1});
    for (const double height : {0.4, 1.0, 1.7})
      EXPECT_EQ(solids.at(x, y, world->ground_m(x, y) + height, 0), nullptr) << i << ": " << x << ' ' << y;
    if (i == 0) continue;
    const auto& before = drive.poses()[i - 1].place_m;
    EXPECT_NEAR(std::hypot(pose.place_m[0] - before[0], pose.place_m[1] - before[1]), 1, 0.95) << i;
  }
  const auto middle = above.begin() + static_cast<std::ptrdiff_t>(above.size() / 2);
  std::nth_element(above.begin(), middle, above.end());
  EXPECT_NEAR(*middle, 0, 0.05);
}

TEST(Drive, MeetsItsBeginningAgain) {
  for (const std::string name : {"city", "bumpy", "indoor"}) {
    const Drive drive(scene(name), small(500));
    const auto poses = drive.poses();
    std::size_t again = 0;
    for (std::size_t i = 60; i < poses.size(); ++i) {
      const bool met =
          std::any_of(poses.begin(), poses.begin() + static_cast<std::ptrdiff_t>(i) - 59, [&](const Pose& p) {
            return std::hypot(p.place_m[0] - poses[i].place_m[0], p.place_m[1] - poses[i].place_m[1]) < 2;
          });
      again += met ? 1 : 0;
    }
    EXPECT_GT(again, 40u) << name;
    EXPECT_LT(again, name == "indoor" ? 400u : 300u) << name;
  }
}

TEST(Drive, KeepsToTheStreetsOfTheCity) {
  const auto world = make_world("city", 3);
  const Drive drive(scene("city"), small(500));
  std::size_t on_street = 0;
  for (const Pose& p : drive.poses()) on_street += world->street_m(p.place_m[0], p.place_m[1]) ? 1 : 0;
  EXPECT_GE(on_street, 480u);
}

TEST(Drive, ScansDependOnNothingElse) {
  const Drive drive(scene("hills"), small(6));
  const auto all = all_scans(drive);
  const auto equal = [](const std::vector<DrivePoint>& a, const std::vector<DrivePoint>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const DrivePoint& p, const DrivePoint& q) {
      return p.x_m == q.x_m && p.y_m == q.y_m && p.z_m == q.z_m && p.intensity == q.intensity && p.label == q.label;
    });
  };
  std::vector<std::vector<DrivePoint>> one(1);
  drive.scan(3, 4, one);
  EXPECT_TRUE(equal(one[0], all[3])) << "alone and together";
  SceneOptions moved = scene("hills");
  moved.origin_x_m = 350'000.25;
  moved.origin_y_m = -5'600'000;
  const Drive far(moved, small(6));
  EXPECT_TRUE(equal(all_scans(far)[4], all[4])) << "wherever the scene is";
  EXPECT_NEAR(far.poses()[4].place_m[0], drive.poses()[4].place_m[0] + 350'000.25, 1e-6);
  SceneOptions other = scene("hills");
  other.seed = 4;
  EXPECT_FALSE(equal(all_scans(Drive(other, small(6)))[4], all[4]));
}

TEST(Drive, DriftGrowsSmoothlyFromNothing) {
  DriveOptions o = small(500);
  const Drive drive(scene("bumpy"), o);
  const auto poses = drive.poses(), drifting = drive.drifting_poses();
  ASSERT_EQ(poses.size(), drifting.size());
  EXPECT_EQ(poses[0].rotation, drifting[0].rotation);
  EXPECT_EQ(poses[0].place_m, drifting[0].place_m);
  double worst = 0, last = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double dz = drifting[i].place_m[2] - poses[i].place_m[2];
    EXPECT_EQ(drifting[i].place_m[0], poses[i].place_m[0]);
    EXPECT_EQ(drifting[i].place_m[1], poses[i].place_m[1]);
    EXPECT_LE(std::abs(dz - last), 0.0071) << "0.4 degrees at most";
    worst = std::max(worst, std::abs(dz));
    last = dz;
    double trace = 0;
    for (std::size_t k = 0; k < 9; ++k) trace += poses[i].rotation[k] * drifting[i].rotation[k];
    EXPECT_GE(trace, 3 - 2e-4);  // 1 + 2 cos(angle), of less than 0.6 degrees
  }
  EXPECT_GT(worst, 0.2);
  o.drift_deg = 0;
  const Drive exact(scene("bumpy"), o);
  EXPECT_EQ(exact.drifting_poses()[400].rotation, exact.poses()[400].rotation);
  EXPECT_EQ(exact.drifting_poses()[400].place_m, exact.poses()[400].place_m);
}

TEST(Drive, NeedsRoom) {
  EXPECT_THROW(Drive(scene("city", 1000), small()), Error);
  EXPECT_THROW(Drive(scene("moon"), small()), Error);
}

// A plain with one plant, 20 m wide.
class Garden final : public World {
 public:
  double ground_m(double, double) const override { return 0; }
  void place(const Box& box, std::vector<Object>& objects) const override {
    Placer placer(*this, box, objects);
    Object o{.label = SceneClass::kLowVegetation, .follows_ground = true, .half_s_m = 10, .half_t_m = 10};
    o.height_m = 3;
    o.opacity = 0.75;
    o.scatter_m = 2;
    placer.add(o);
  }
};

TEST(Surroundings, LeavesLetTheirShareThrough) {
  const Garden garden;
  const Surroundings around(garden, {-12, -12, 12, 12});
  int stopped = 0, ground = 0;
  for (int i = 0; i < 60; ++i)
    for (int j = 0; j < 60; ++j) {
      const auto hit = around.first_hit({-9 + 0.3 * i, -9 + 0.3 * j, 9, 0, 0, -1}, 20);
      ASSERT_TRUE(hit);
      if (hit->object == nullptr) {
        ++ground;
        EXPECT_NEAR(hit->range_m, 9, 1e-5);
      } else {
        ++stopped;
        EXPECT_GE(hit->range_m, 6);
        EXPECT_LE(hit->range_m, 8);
      }
    }
  EXPECT_NEAR(stopped / 3600.0, 0.75, 0.03);
  EXPECT_GT(ground, 0);
}

}  // namespace
}  // namespace btms
