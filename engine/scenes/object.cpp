#include "engine/scenes/object.h"

#include <algorithm>
#include <cmath>

namespace btms {

Frame Frame::moved(double s_m, double t_m, double c, double d) const {
  const double det = s_x * t_y - s_y * t_x;
  return {x_m + (t_y * s_m - s_y * t_m) / det,
          y_m + (s_x * t_m - t_x * s_m) / det,
          c * s_x + d * t_x,
          c * s_y + d * t_y,
          c * t_x - d * s_x,
          c * t_y - d * s_y};
}

Box Object::bounds(double margin_m) const {
  const double det = std::abs(frame.s_x * frame.t_y - frame.s_y * frame.t_x);
  const double hs = half_s_m + margin_m, ht = half_t_m + margin_m;
  const double dx = (std::abs(frame.t_y) * hs + std::abs(frame.s_y) * ht) / det;
  const double dy = (std::abs(frame.t_x) * hs + std::abs(frame.s_x) * ht) / det;
  return {frame.x_m - dx, frame.y_m - dy, frame.x_m + dx, frame.y_m + dy};
}

std::optional<double> Object::top(double x_m, double y_m) const {
  const double dx = x_m - frame.x_m, dy = y_m - frame.y_m;
  const double s = frame.s_x * dx + frame.s_y * dy, t = frame.t_x * dx + frame.t_y * dy;
  const double inside_s = half_s_m - std::abs(s), inside_t = half_t_m - std::abs(t);
  if (inside_s < 0 || inside_t < 0) return std::nullopt;
  const double rise = height_m - eaves_m;
  switch (form) {
    case Form::kSlab:
      return height_m + (std::min(inside_s, inside_t) < rim_width_m ? rim_height_m : 0);
    case Form::kGable:
      return eaves_m + rise * inside_t / half_t_m;
    case Form::kHip:
      return eaves_m + rise * std::min(inside_s, inside_t) / std::min(half_s_m, half_t_m);
    case Form::kSawtooth: {
      constexpr double kPeriod_m = 7;
      const double p = (s + half_s_m) / kPeriod_m;
      return eaves_m + rise * (p - std::floor(p));
    }
    case Form::kDeck: {
      const double u = 0.5 + 0.5 * s / half_s_m, v = 0.5 + 0.5 * t / half_t_m;
      const double south = corners_m[0] + (corners_m[1] - corners_m[0]) * u;
      const double north = corners_m[2] + (corners_m[3] - corners_m[2]) * u;
      return south + (north - south) * v + (inside_t < rim_width_m ? rim_height_m : 0);
    }
    case Form::kDome: {
      const double a = s / half_s_m, b = t / half_t_m, r2 = a * a + b * b;
      if (r2 > 1) return std::nullopt;
      return eaves_m + rise * std::sqrt(1 - r2);
    }
    case Form::kCar:
      return std::abs(s) < 0.45 * half_s_m ? height_m : eaves_m;
  }
  return std::nullopt;
}

bool Object::beside(double x_m, double y_m, double distance_m) const {
  const double dx = x_m - frame.x_m, dy = y_m - frame.y_m;
  const double s = std::abs(frame.s_x * dx + frame.s_y * dy), t = std::abs(frame.t_x * dx + frame.t_y * dy);
  return (s > half_s_m || t > half_t_m) && s <= half_s_m + distance_m && t <= half_t_m + distance_m;
}

}  // namespace btms
