#include "apps/btms/query_line.h"

#include <spdlog/fmt/fmt.h>

#include "apps/btms/report.h"
#include "engine/query/profile.h"

namespace btms {
namespace {

const char* state_of(const HeightAnswer& height) {
  return height.status == QueryStatus::kOk ? node_state_name(height.state) : query_status_name(height.status);
}

}  // namespace

void print_profile(const Terrain& terrain, std::span<const Place> line, double step_m, bool json) {
  Json points = Json::array();
  if (!json) print_line("# distance_m x_m y_m z_m state sd_m");
  for (const ProfilePoint& p : profile(terrain, line, step_m)) {
    const bool known = p.height.status == QueryStatus::kOk;
    if (json)
      points.push_back({tidy(p.distance_m), known ? Json(tidy(p.height.z_m)) : Json(), state_of(p.height)});
    else
      print_line(fmt::format("{:.3f} {:.3f} {:.3f} {:.3f} {} {:.3f}", p.distance_m, p.place.x_m, p.place.y_m,
                             p.height.z_m, state_of(p.height), std::sqrt(p.height.variance_m2)));
  }
  if (json) print_json(Json{{"profile", points}});
}

void print_check(const Terrain& terrain, std::span<const Place> line, double length_m, double width_m,
                 const VehicleLimits& limits, bool json) {
  const double ahead = length_m / 2, left = width_m / 2;
  const Place footprint[] = {{-ahead, -left}, {ahead, -left}, {ahead, left}, {-ahead, left}};
  const CheckAnswer a = check_path(terrain, line, footprint, limits);
  if (json) {
    const auto number = [](double n) { return std::isfinite(n) ? Json(tidy(n)) : Json(); };
    Json bad;
    if (!a.safe) bad = {{"x", number(a.at.x_m)}, {"y", number(a.at.y_m)}, {"reason", hazard_name(a.hazard)}};
    print_json(Json{{"is_safe", a.safe}, {"traversability", tidy(a.traversability)}, {"first_bad", bad}});
  } else if (a.safe) {
    print_line(fmt::format("safe, traversability {:.3f}", a.traversability));
  } else {
    print_line(fmt::format("not safe: {} at {:.3f} {:.3f}", hazard_name(a.hazard), a.at.x_m, a.at.y_m));
  }
}

}  // namespace btms
