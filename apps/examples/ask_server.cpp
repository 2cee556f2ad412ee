// ask_server URL NAME X Y: what docs/client.md shows.
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "engine/error.h"
#include "io/client/fresh_tiles.h"

namespace {

void ask(const char* url, const char* name, btms::Place here) {
  btms::MapClient map({.url = url, .token = {}}, name);
  const btms::MapDescription description = map.description();
  std::printf("%s, revision %llu, %zu levels\n", description.id.c_str(),
              static_cast<unsigned long long>(description.revision), description.levels.size());

  const btms::Place there = {here.x_m + 10, here.y_m};
  const std::vector<btms::Place> path = {here, there};
  std::printf("height %.2f\n", map.height(here).z_m);
  std::printf("the way there is %s\n", map.check_path(path).safe ? "safe" : "not safe");
  const btms::ClientRoute route = map.route(here, there);
  std::printf("route %s, %zu places\n", route.status.c_str(), route.points.size());

  btms::FreshOptions options;
  options.server.url = url;
  options.map = name;
  options.radius_m = 100;
  options.budget_bytes = 16 << 20;
  btms::FreshTiles tiles(options);
  tiles.move_to(here);
  if (!tiles.wait_until_fresh(std::chrono::seconds(20)))
    throw btms::Error(btms::ErrorCode::kFailed, tiles.freshness().wrong);
  const auto snapshot = tiles.snapshot();
  std::printf("%zu tiles, elevation here %.2f, %.1f s old\n", snapshot->tiles.size(), snapshot->value(0, here),
              tiles.freshness().age_s);
  const auto changed =
      tiles.wait_for_change(btms::Watch::along(path, 2), snapshot->number, std::chrono::milliseconds(100));
  if (changed) std::printf("the map has changed along the way: check it again\n");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: ask_server URL NAME X Y\n");
    return 2;
  }
  try {
    ask(argv[1], argv[2], {std::atof(argv[3]), std::atof(argv[4])});
    return 0;
  } catch (const btms::Error& error) {
    std::fprintf(stderr, "ask_server: %s\n", error.what());
    return btms::exit_status(error.code());
  }
}
