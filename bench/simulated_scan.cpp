#include "bench/simulated_scan.h"

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

namespace btms::bench {

std::vector<ScenePoint> simulate_scan(const std::vector<ScenePoint>& points, const SensorPlace& sensor) {
  constexpr double kTop_rad = 2.0 * std::numbers::pi / 180, kBottom_rad = -24.8 * std::numbers::pi / 180;
  constexpr int kBeams = 64, kAzimuths = 2048;
  struct Return {
    double range_m = std::numeric_limits<double>::infinity();
    ScenePoint point;
  };
  std::vector<Return> returns(std::size_t{kBeams} * kAzimuths);
  for (const ScenePoint& p : points) {
    const double x = static_cast<double>(p.x_mm) / 1000 - sensor.x_m,
                 y = static_cast<double>(p.y_mm) / 1000 - sensor.y_m;
    const double z = p.z_mm / 1000.0 - sensor.z_m, flat = std::hypot(x, y);
    const double beam = std::floor((kTop_rad - std::atan2(z, flat)) / (kTop_rad - kBottom_rad) * kBeams);
    if (beam < 0 || beam >= kBeams || flat < 2.5) continue;  // nearer is the car itself
    const double turn = std::atan2(y, x) / (2 * std::numbers::pi) + 0.5;
    const int azimuth = static_cast<int>(turn * kAzimuths) % kAzimuths;
    Return& nearest = returns[static_cast<std::size_t>(static_cast<int>(beam) * kAzimuths + azimuth)];
    if (flat >= nearest.range_m) continue;
    nearest.range_m = flat;
    nearest.point = {std::llround(x * 1000), std::llround(y * 1000), static_cast<std::int32_t>(std::lround(z * 1000)),
                     p.label};
  }
  std::vector<ScenePoint> scan;
  for (const Return& r : returns)
    if (std::isfinite(r.range_m)) scan.push_back(r.point);
  return scan;
}

}  // namespace btms::bench
