#include "engine/query/profile.h"

#include <cmath>

#include "engine/error.h"

namespace btms {
namespace {

// 0 where one of them is no place.
double way_m(Place from, Place to) {
  return on_plane(from) && on_plane(to) ? std::hypot(to.x_m - from.x_m, to.y_m - from.y_m) : 0;
}

}  // namespace

std::vector<ProfilePoint> profile(const Terrain& terrain, std::span<const Place> line, double step_m, double z_hint_m) {
  double length_m = 0;
  for (std::size_t i = 1; i < line.size(); ++i) length_m += way_m(line[i - 1], line[i]);
  const double most = static_cast<double>(line.size()) + (step_m > 0 ? length_m / step_m : 0);
  if (!(step_m == 0 || step_m >= 0.001))
    throw Error(ErrorCode::kUsage, "the step of a profile is 0, or at least a millimetre");
  if (most > kMostProfilePoints)
    throw Error(ErrorCode::kUsage, "a profile has at most 2^20 points; take a longer step");

  std::vector<ProfilePoint> points;
  points.reserve(static_cast<std::size_t>(most) + 1);
  const auto add = [&](double distance_m, Place place) {
    points.push_back({distance_m, place, terrain.height(place, z_hint_m)});
    if (points.back().height.status == QueryStatus::kOk) z_hint_m = points.back().height.z_m;
  };
  double begun_m = 0;  // where the segment begins
  double next = 1;     // multiple of the step
  for (std::size_t i = 0; i < line.size(); ++i) {
    const double way = i > 0 ? way_m(line[i - 1], line[i]) : 0;
    // What is less than a millimetre off a vertex is the vertex.
    for (; step_m > 0 && next * step_m < begun_m + way + 0.001; ++next) {
      const double part = (next * step_m - begun_m) / way;
      if (next * step_m <= begun_m + 0.001 || next * step_m >= begun_m + way - 0.001) continue;
      add(next * step_m, {line[i - 1].x_m + part * (line[i].x_m - line[i - 1].x_m),
                          line[i - 1].y_m + part * (line[i].y_m - line[i - 1].y_m)});
    }
    begun_m += way;
    add(begun_m, line[i]);
  }
  return points;
}

}  // namespace btms
