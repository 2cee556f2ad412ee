#include "apps/server/area.h"

#include <algorithm>
#include <cmath>

namespace btms {
namespace {

double cross(Place o, Place a, Place b) {
  return (a.x_m - o.x_m) * (b.y_m - o.y_m) - (a.y_m - o.y_m) * (b.x_m - o.x_m);
}

// Whether the segment has a place in the box: separating axes.
bool crosses(Place a, Place b, const Area::Box& box) {
  if (std::max(a.x_m, b.x_m) < box[0] || std::min(a.x_m, b.x_m) > box[2] || std::max(a.y_m, b.y_m) < box[1] ||
      std::min(a.y_m, b.y_m) > box[3])
    return false;
  const double sides[] = {cross(a, b, {box[0], box[1]}), cross(a, b, {box[2], box[1]}), cross(a, b, {box[2], box[3]}),
                          cross(a, b, {box[0], box[3]})};
  return !(std::all_of(std::begin(sides), std::end(sides), [](double s) { return s > 0; }) ||
           std::all_of(std::begin(sides), std::end(sides), [](double s) { return s < 0; }));
}

}  // namespace

Area Area::disc(Place centre, double radius_m) {
  Area area;
  area.centre_ = centre;
  area.radius_m_ = radius_m;
  area.bounds_ = {centre.x_m - radius_m, centre.y_m - radius_m, centre.x_m + radius_m, centre.y_m + radius_m};
  return area;
}

Area Area::polygon(std::vector<Place> corners) {
  Area area;
  area.bounds_ = {corners[0].x_m, corners[0].y_m, corners[0].x_m, corners[0].y_m};
  for (const Place& c : corners)
    area.bounds_ = {std::min(area.bounds_[0], c.x_m), std::min(area.bounds_[1], c.y_m),
                    std::max(area.bounds_[2], c.x_m), std::max(area.bounds_[3], c.y_m)};
  area.centre_ = {(area.bounds_[0] + area.bounds_[2]) / 2, (area.bounds_[1] + area.bounds_[3]) / 2};
  area.corners_ = std::move(corners);
  return area;
}

bool Area::meets(const Box& box) const {
  if (corners_.empty()) {
    const double dx = centre_.x_m - std::clamp(centre_.x_m, box[0], box[2]);
    const double dy = centre_.y_m - std::clamp(centre_.y_m, box[1], box[3]);
    return dx * dx + dy * dy <= radius_m_ * radius_m_;
  }
  if (bounds_[0] > box[2] || bounds_[2] < box[0] || bounds_[1] > box[3] || bounds_[3] < box[1]) return false;
  // An edge in the box, or the box wholly inside.
  bool inside = false;
  for (std::size_t i = 0, k = corners_.size() - 1; i < corners_.size(); k = i++) {
    const Place a = corners_[i], b = corners_[k];
    if (crosses(a, b, box)) return true;
    if ((a.y_m > box[1]) != (b.y_m > box[1]) && box[0] < (b.x_m - a.x_m) * (box[1] - a.y_m) / (b.y_m - a.y_m) + a.x_m)
      inside = !inside;
  }
  return inside;
}

double Area::distance2_m2(const Box& box) const {
  const double dx = (box[0] + box[2]) / 2 - centre_.x_m, dy = (box[1] + box[3]) / 2 - centre_.y_m;
  return dx * dx + dy * dy;
}

CellBox Area::tiles(double edge_m) const {
  const auto at = [&](double m, double more) {
    return static_cast<std::int32_t>(std::clamp(std::floor(m / edge_m) + more, -2e9, 2e9));
  };
  return {at(bounds_[0], 0), at(bounds_[1], 0), at(bounds_[2], 1), at(bounds_[3], 1)};
}

}  // namespace btms
