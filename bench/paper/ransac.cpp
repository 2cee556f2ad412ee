#include "bench/paper/ransac.h"

#include <Eigen/Geometry>
#include <cmath>
#include <random>

namespace btms::bench {
namespace {

struct Plane {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();
  float offset = 0;
};

std::size_t count_near(const std::vector<Eigen::Vector3f>& points, const Plane& plane, float distance) {
  std::size_t n = 0;
  for (const Eigen::Vector3f& p : points) n += std::abs(plane.normal.dot(p) + plane.offset) <= distance;
  return n;
}

}  // namespace

std::vector<std::uint8_t> ransac_ground(const std::vector<Eigen::Vector3f>& points, const RansacParameters& p) {
  std::vector<std::uint8_t> ground(points.size(), 0);
  if (points.size() < 3) return ground;
  std::mt19937_64 random(p.seed);
  std::uniform_int_distribution<std::size_t> any(0, points.size() - 1);
  const auto distance = static_cast<float>(p.distance_m);
  const double least_z = std::cos(p.slope_max_deg * 3.14159265358979 / 180);
  Plane best;
  std::size_t most = 0;
  for (int i = 0; i < p.rounds; ++i) {
    const Eigen::Vector3f &a = points[any(random)], &b = points[any(random)], &c = points[any(random)];
    const Eigen::Vector3f across = (b - a).cross(c - a);
    const float length = across.norm();
    if (!(length > 1e-6f) || std::abs(across.z()) < least_z * length) continue;
    const Plane plane{across / length, -across.dot(a) / length};
    if (const std::size_t n = count_near(points, plane, distance); n > most) {
      most = n;
      best = plane;
    }
  }
  if (most == 0) return ground;
  for (std::size_t i = 0; i < points.size(); ++i)
    ground[i] = std::abs(best.normal.dot(points[i]) + best.offset) <= distance;
  return ground;
}

}  // namespace btms::bench
