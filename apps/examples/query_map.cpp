// query_map MAP X1 Y1 X2 Y2: what a planner asks about going from one place to another (docs/query_library.md).
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "engine/error.h"
#include "engine/query/footprint.h"
#include "engine/query/nearest.h"
#include "engine/query/profile.h"
#include "io/store/open_terrain.h"

namespace {

void ask(const char* folder, btms::Place from, btms::Place to) {
  const auto [reader, terrain] = btms::open_terrain(folder, {.cache_bytes = 64 << 20});

  const btms::HeightAnswer here = terrain.height(from);
  if (here.status != btms::QueryStatus::kOk) {
    std::printf("no height: %s\n", btms::query_status_name(here.status));
    return;
  }
  std::printf("height %.3f m, sd %.3f m, %s\n", here.z_m, std::sqrt(here.variance_m2),
              btms::node_state_name(here.state));

  const std::vector<btms::Place> line = {from, to};
  double climb_m = 0, last_m = here.z_m;
  for (const btms::ProfilePoint& point : btms::profile(terrain, line, 1.0)) {
    if (point.height.z_m > last_m) climb_m += point.height.z_m - last_m;
    if (point.height.status == btms::QueryStatus::kOk) last_m = point.height.z_m;
  }
  std::printf("climbs %.1f m\n", climb_m);

  btms::VehicleLimits limits = btms::limits_of(reader->info().parameters);  // or your own
  limits.slope_deg = 15;
  const std::vector<btms::Place> car = {{-1, -0.9}, {3.2, -0.9}, {3.2, 0.9}, {-1, 0.9}};  // x ahead, y left
  const btms::CheckAnswer path = btms::check_path(terrain, line, car, limits);
  if (path.safe)
    std::printf("safe, traversability %.2f\n", path.traversability);
  else
    std::printf("not safe: %s at %.1f %.1f\n", btms::hazard_name(path.hazard), path.at.x_m, path.at.y_m);

  if (const auto place = btms::nearest_traversable(terrain, to, 1.0, 20.0, limits))
    std::printf("the nearest place to stand at the end is %.1f %.1f\n", place->x_m, place->y_m);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    std::fprintf(stderr, "query_map MAP X1 Y1 X2 Y2\n");
    return 2;
  }
  try {
    ask(argv[1], {std::atof(argv[2]), std::atof(argv[3])}, {std::atof(argv[4]), std::atof(argv[5])});
  } catch (const btms::Error& error) {
    std::fprintf(stderr, "query_map: %s\n", error.what());
    return btms::exit_status(error.code());
  }
  return 0;
}
