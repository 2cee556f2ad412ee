#include "engine/query/profile.h"

#include <cmath>

#include "engine/error.h"

namespace btms {

std::vector<ProfilePoint> profile(const Terrain& terrain, std::span<const Place> line, double step_m, double z_hint_m) {
  if (line.empty()) throw Error(ErrorCode::kUsage, "a line has at least one place");
  if (!(step_m >= 0))
    throw Error(ErrorCode::kUsage, "the distance between places is a number of metres, not below zero");
  double length_m = 0;
  for (std::size_t i = 1; i < line.size(); ++i)
    length_m += std::hypot(line[i].x_m - line[i - 1].x_m, line[i].y_m - line[i - 1].y_m);
  const double points = static_cast<double>(line.size()) + (step_m > 0 ? length_m / step_m : 0);
  if (!std::isfinite(length_m) || !(points <= static_cast<double>(kMaxProfilePoints)))
    throw Error(ErrorCode::kUsage, "the line has too many places, or ones that are not finite");

  std::vector<ProfilePoint> out;
  double hint_m = z_hint_m;
  const auto add = [&](double distance_m, Place place) {
    out.push_back({distance_m, place, terrain.height(place, hint_m)});
    if (out.back().height.status == QueryStatus::kOk) hint_m = out.back().height.z_m;
  };
  // Places lie at multiples of the step along the whole line.
  double begin_m = 0;
  add(0, line[0]);
  for (std::size_t i = 1; i < line.size(); ++i) {
    const double dx = line[i].x_m - line[i - 1].x_m, dy = line[i].y_m - line[i - 1].y_m, leg_m = std::hypot(dx, dy);
    if (step_m > 0)
      for (double k = std::floor(begin_m / step_m) + 1; k * step_m < begin_m + leg_m; ++k) {
        const double share = (k * step_m - begin_m) / leg_m;
        add(k * step_m, {line[i - 1].x_m + share * dx, line[i - 1].y_m + share * dy});
      }
    begin_m += leg_m;
    add(begin_m, line[i]);
  }
  return out;
}

}  // namespace btms
