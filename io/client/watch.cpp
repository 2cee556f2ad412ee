#include "io/client/watch.h"

#include <algorithm>

namespace btms {
namespace {

using Box = std::array<double, 4>;

// Clips the segment against the box's four sides.
bool crosses(Place a, Place b, const Box& box) {
  double from = 0, to = 1;
  const auto clip = [&](double start, double step, double low, double high) {
    if (step == 0) return start >= low && start <= high;
    const double first = (low - start) / step, second = (high - start) / step;
    from = std::max(from, std::min(first, second));
    to = std::min(to, std::max(first, second));
    return from <= to;
  };
  return clip(a.x_m, b.x_m - a.x_m, box[0], box[2]) && clip(a.y_m, b.y_m - a.y_m, box[1], box[3]);
}

bool holds(std::span<const Place> polygon, Place p) {
  bool inside = false;
  for (std::size_t i = 0, k = polygon.size() - 1; i < polygon.size(); k = i++) {
    const Place a = polygon[i], b = polygon[k];
    if ((a.y_m > p.y_m) != (b.y_m > p.y_m) && p.x_m < (b.x_m - a.x_m) * (p.y_m - a.y_m) / (b.y_m - a.y_m) + a.x_m)
      inside = !inside;
  }
  return inside;
}

}  // namespace

Watch Watch::along(std::span<const Place> line, double reach_m) {
  Watch watch;
  watch.places_.assign(line.begin(), line.end());
  watch.reach_m_ = reach_m;
  return watch;
}

Watch Watch::inside(std::span<const Place> polygon) {
  Watch watch = along(polygon, 0);
  watch.filled_ = true;
  return watch;
}

bool Watch::meets(const Box& box) const {
  if (places_.empty()) return false;
  const Box wide{box[0] - reach_m_, box[1] - reach_m_, box[2] + reach_m_, box[3] + reach_m_};
  if (places_.size() == 1) return crosses(places_[0], places_[0], wide);
  for (std::size_t i = 1; i < places_.size(); ++i)
    if (crosses(places_[i - 1], places_[i], wide)) return true;
  return filled_ && (crosses(places_.back(), places_.front(), wide) || holds(places_, {box[0], box[1]}));
}

}  // namespace btms
