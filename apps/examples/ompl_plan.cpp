// ompl_plan MAP X1 Y1 X2 Y2 PICTURE: OMPL plans for a robot on the query library (docs/routing.md).
#include <ompl/base/MotionValidator.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "engine/error.h"
#include "engine/query/footprint.h"
#include "engine/query/nearest.h"
#include "io/export/route_picture.h"
#include "io/store/open_terrain.h"

namespace {

namespace ob = ompl::base;

constexpr double kSeconds = 5;
// A robot with tracks: drives ahead, turns on the spot. x ahead, y left.
const std::vector<btms::Place> kRobot = {{-0.8, -0.5}, {0.8, -0.5}, {0.8, 0.5}, {-0.8, 0.5}};
const double kTurning_m = std::hypot(0.8, 0.5);  // radius of what it sweeps when it turns

btms::Place place_of(const ob::State* state) {
  const auto* s = state->as<ob::RealVectorStateSpace::StateType>();
  return {(*s)[0], (*s)[1]};
}

struct Counter {
  std::size_t n = 0;
  std::chrono::duration<double> time{0};

  template <class Check>
  bool count(const Check& check) {
    const auto began = std::chrono::steady_clock::now();
    const bool answer = check();
    time += std::chrono::steady_clock::now() - began;
    ++n;
    return answer;
  }
  void print(const char* what) const {
    std::printf("%zu %s checked, %.0f thousand a second\n", n, what, static_cast<double>(n) / 1000 / time.count());
  }
};

// What OMPL asks about, answered by the map.
struct Checker final : ob::MotionValidator {
  Checker(const ob::SpaceInformationPtr& space, const btms::Terrain& map, const btms::VehicleLimits& its)
      : MotionValidator(space), terrain(map), limits(its) {}

  bool may_turn_at(const ob::State* state) const {
    return places.count([&] { return btms::check_disc(terrain, place_of(state), kTurning_m, limits).safe; });
  }
  // Exact: OMPL's own validator would look at poses only.
  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    const btms::Place line[] = {place_of(from), place_of(to)};
    return may_turn_at(to) && motions.count([&] { return btms::check_path(terrain, line, kRobot, limits).safe; });
  }
  bool checkMotion(const ob::State* from, const ob::State* to, std::pair<ob::State*, double>& last) const override {
    last.second = 0;
    if (last.first) si_->copyState(last.first, from);
    return checkMotion(from, to);
  }

  const btms::Terrain& terrain;
  const btms::VehicleLimits limits;
  mutable Counter places, motions;
};

void draw(const btms::MapReader& map, const std::vector<btms::Place>& way, const char* picture) {
  btms::Relief relief = btms::draw_relief(map, btms::surroundings(way, map.layout().lattice), btms::kReliefPixels,
                                          btms::picture_layer("cost"));
  btms::draw_way(relief, way, btms::kRouteColour);
  btms::draw_mark(relief, way.front(), btms::kStartColour, "from");
  btms::draw_mark(relief, way.back(), btms::kGoalColour, "to");
  relief.picture.write_png(picture);
}

int plan(const char* folder, btms::Place wanted_from, btms::Place wanted_to, const char* picture) {
  const auto [reader, terrain] = btms::open_terrain(folder, {.cache_bytes = 256 << 20});
  const btms::VehicleLimits limits = btms::limits_of(reader->info().parameters);
  const auto from_there = btms::nearest_traversable(terrain, wanted_from, kTurning_m, 20, limits);
  const auto to_there = btms::nearest_traversable(terrain, wanted_to, kTurning_m, 20, limits);
  if (!from_there || !to_there) {
    std::printf("no place to stand within 20 m\n");
    return 1;
  }
  const btms::Place from = *from_there, to = *to_there;
  const std::vector<btms::Place> straight = {from, to};
  std::printf("the straight line is %s\n",
              btms::check_path(terrain, straight, kRobot, limits).safe ? "free" : "blocked");

  const auto space = std::make_shared<ob::RealVectorStateSpace>(2);
  const double room_m = std::hypot(to.x_m - from.x_m, to.y_m - from.y_m) / 4;
  ob::RealVectorBounds bounds(2);
  bounds.setLow(0, std::min(from.x_m, to.x_m) - room_m);
  bounds.setHigh(0, std::max(from.x_m, to.x_m) + room_m);
  bounds.setLow(1, std::min(from.y_m, to.y_m) - room_m);
  bounds.setHigh(1, std::max(from.y_m, to.y_m) + room_m);
  space->setBounds(bounds);

  ompl::geometric::SimpleSetup setup(space);
  const ob::SpaceInformationPtr& information = setup.getSpaceInformation();
  const auto checker = std::make_shared<Checker>(information, terrain, limits);
  information->setMotionValidator(checker);
  setup.setStateValidityChecker([&](const ob::State* state) { return checker->may_turn_at(state); });
  ob::ScopedState<ob::RealVectorStateSpace> start(space), goal(space);
  start[0] = from.x_m;
  start[1] = from.y_m;
  goal[0] = to.x_m;
  goal[1] = to.y_m;
  setup.setStartAndGoalStates(start, goal);
  setup.setPlanner(std::make_shared<ompl::geometric::BITstar>(information));
  setup.solve(kSeconds);
  checker->places.print("places");
  checker->motions.print("motions");
  if (!setup.haveExactSolutionPath()) {
    std::printf("no plan\n");
    return 1;
  }
  std::vector<btms::Place> way;
  for (const ob::State* state : setup.getSolutionPath().getStates()) way.push_back(place_of(state));
  const btms::CheckAnswer all = btms::check_path(terrain, way, kRobot, limits);
  std::printf("plan of %.1f m in %zu legs, ", setup.getSolutionPath().length(), way.size() - 1);
  if (all.safe)
    std::printf("safe all along\n");
  else
    std::printf("not safe: %s at %.1f %.1f\n", btms::hazard_name(all.hazard), all.at.x_m, all.at.y_m);
  draw(*reader, way, picture);
  return all.safe ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 7) {
    std::fprintf(stderr, "ompl_plan MAP X1 Y1 X2 Y2 PICTURE.png\n");
    return 2;
  }
  ompl::RNG::setSeed(1);
  ompl::msg::setLogLevel(ompl::msg::LOG_ERROR);
  try {
    return plan(argv[1], {std::atof(argv[2]), std::atof(argv[3])}, {std::atof(argv[4]), std::atof(argv[5])}, argv[6]);
  } catch (const btms::Error& error) {
    std::fprintf(stderr, "ompl_plan: %s\n", error.what());
    return btms::exit_status(error.code());
  }
}
