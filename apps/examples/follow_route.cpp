// follow_route URL NAME X1 Y1 X2 Y2 [MAP PICTURE]: a vehicle drives a route on a served map, hears when the map changes
// under it, and takes another way (docs/client.md). follow_route.sh plays the rest of the world.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "engine/error.h"
#include "io/client/fresh_tiles.h"
#include "io/export/legend.h"
#include "io/export/route_picture.h"
#include "io/store/open_terrain.h"

namespace {

using std::chrono::milliseconds;
using Line = std::vector<btms::Place>;

constexpr double kStep_m = 1;          // the vehicle goes so far
constexpr milliseconds kStepTime{20};  // in this time: 50 m/s, for a short demonstration
constexpr double kReach_m = 2;         // changes so near to the route are looked at
constexpr double kHaltShare = 0.3;     // of the route; there the vehicle waits for news, so that they come in time
constexpr milliseconds kHaltTime{60'000};
constexpr btms::Rgb kSecondColour{0, 160, 140}, kDrivenColour{20, 20, 20}, kWallColour{150, 30, 160};

struct Drive {
  Line first, second, driven;
  btms::Place wall;
};

double distance_m(btms::Place a, btms::Place b) { return std::hypot(b.x_m - a.x_m, b.y_m - a.y_m); }

double length_m(const Line& line) {
  double sum = 0;
  for (std::size_t i = 1; i < line.size(); ++i) sum += distance_m(line[i - 1], line[i]);
  return sum;
}

// Takes the first `step_m` off the line; it begins where the vehicle is.
void advance(Line& line, double step_m) {
  while (line.size() > 1 && distance_m(line[0], line[1]) <= step_m) {
    step_m -= distance_m(line[0], line[1]);
    line.erase(line.begin());
  }
  if (line.size() < 2) return;
  const double share = step_m / distance_m(line[0], line[1]);
  line[0] = {line[0].x_m + share * (line[1].x_m - line[0].x_m), line[0].y_m + share * (line[1].y_m - line[0].y_m)};
}

Line route(btms::MapClient& map, btms::Place from, btms::Place to) {
  const btms::ClientRoute route = map.route(from, to);
  if (route.status != "found") throw btms::Error(btms::ErrorCode::kFailed, "no route: " + route.status);
  std::printf("route of %.0f m on revision %llu\n", route.length_m, static_cast<unsigned long long>(route.revision));
  Line line;
  for (const auto& point : route.points) line.push_back(point.place);
  return line;
}

Drive drive(const btms::ClientOptions& server, const char* name, btms::Place from, btms::Place to) {
  btms::MapClient map(server, name);
  const double radius_m = 0.45 * map.description().vehicle_width_m;
  btms::FreshOptions options;
  options.server = server;
  options.map = name;
  btms::FreshTiles tiles(options);
  tiles.move_to(from);
  if (!tiles.wait_until_fresh(milliseconds(20'000)))
    throw btms::Error(btms::ErrorCode::kFailed, tiles.freshness().wrong);

  std::uint64_t seen = tiles.snapshot()->number;
  Line rest = route(map, from, to);
  Drive drive{rest, {}, {rest[0]}, {}};
  const double all_m = length_m(rest);
  bool halted = false;
  while (rest.size() > 1) {
    const bool halt = !halted && length_m(rest) < (1 - kHaltShare) * all_m;
    if (halt) {
      halted = true;
      std::printf("halt at %.1f %.1f, waiting for news\n", rest[0].x_m, rest[0].y_m);
      std::fflush(stdout);
    }
    // Time passes here, unless something changes along the route.
    const auto changed = tiles.wait_for_change(btms::Watch::along(rest, kReach_m), seen, halt ? kHaltTime : kStepTime);
    if (changed) {
      seen = changed->number;
      const btms::ClientCheck check = map.check_path(rest, radius_m);
      std::printf("the map has changed along the route: %s\n", check.safe ? "safe still" : check.reason.c_str());
      if (!check.safe) {
        drive.wall = check.first_bad;
        rest = drive.second = route(map, rest[0], to);
      }
    }
    advance(rest, kStep_m);
    drive.driven.push_back(rest[0]);
    tiles.move_to(rest[0]);
  }
  std::printf("arrived after %.0f m, tiles %.1f s old\n", length_m(drive.driven), tiles.freshness().age_s);
  return drive;
}

void draw(const Drive& drive, const char* folder, const char* file) {
  const auto map = btms::open_terrain(folder);
  Line all = drive.first;
  all.insert(all.end(), drive.second.begin(), drive.second.end());
  btms::Relief relief = btms::draw_relief(*map.reader, btms::surroundings(all, map.terrain.layout().lattice),
                                          btms::kReliefPixels, btms::picture_layer("cost"));
  btms::draw_way(relief, drive.first, btms::kRouteColour, 10);
  if (!drive.second.empty()) btms::draw_way(relief, drive.second, kSecondColour, 10);
  // Dots, so that the routes below them are seen.
  for (std::size_t i = 0; i < drive.driven.size(); i += 6)
    btms::draw_way(relief, std::span(&drive.driven[i], 1), kDrivenColour, 5);
  btms::draw_mark(relief, drive.first.front(), btms::kStartColour, "from");
  btms::draw_mark(relief, drive.first.back(), btms::kGoalColour, "to");
  if (!drive.second.empty()) btms::draw_mark(relief, drive.wall, kWallColour, "wall");

  const int strip = 2 * btms::Legend::kHeight, height = relief.picture.height();
  btms::Picture picture(relief.picture.width(), height + strip, {255, 255, 255});
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < picture.width(); ++x) picture.set(x, y, relief.picture.at(x, y));
  btms::Legend legend(picture, 2);
  legend.swatch({btms::kRouteColour, "first route"});
  legend.swatch({kSecondColour, "second route"});
  legend.swatch({kDrivenColour, "driven"});
  legend.swatch({kWallColour, "wall in the way"});
  picture.write_png(file);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 7 && argc != 9) {
    std::fprintf(stderr, "usage: follow_route URL NAME X1 Y1 X2 Y2 [MAP PICTURE]\n");
    return 2;
  }
  try {
    btms::ClientOptions server;
    server.url = argv[1];
    const Drive done =
        drive(server, argv[2], {std::atof(argv[3]), std::atof(argv[4])}, {std::atof(argv[5]), std::atof(argv[6])});
    if (argc == 9) draw(done, argv[7], argv[8]);
    return 0;
  } catch (const btms::Error& error) {
    std::fprintf(stderr, "follow_route: %s\n", error.what());
    return btms::exit_status(error.code());
  }
}
