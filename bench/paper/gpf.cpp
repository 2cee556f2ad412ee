#include "bench/paper/gpf.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace btms::bench {
namespace {

using Points = std::vector<Eigen::Vector3f>;
using Indices = std::vector<std::size_t>;

Indices seeds_of(const Points& points, const Indices& segment, const GpfParameters& p) {
  std::vector<float> z;
  for (const std::size_t i : segment) z.push_back(points[i].z());
  const std::size_t n = std::min(z.size(), static_cast<std::size_t>(p.lowest_points));
  std::partial_sort(z.begin(), z.begin() + static_cast<std::ptrdiff_t>(n), z.end());
  double lowest = 0;
  for (std::size_t i = 0; i < n; ++i) lowest += static_cast<double>(z[i]) / static_cast<double>(n);
  Indices seeds;
  for (const std::size_t i : segment)
    if (static_cast<double>(points[i].z()) < lowest + p.seeds_m) seeds.push_back(i);
  return seeds;
}

// What of the segment lies at most Th_dist above the plane through `ground`.
Indices near_plane(const Points& points, const Indices& segment, const Indices& ground, const GpfParameters& p) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const std::size_t i : ground) mean += points[i].cast<double>();
  mean /= static_cast<double>(ground.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const std::size_t i : ground) {
    const Eigen::Vector3d d = points[i].cast<double>() - mean;
    covariance += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  Eigen::Vector3d normal = solver.eigenvectors().col(0);
  if (normal.z() < 0) normal = -normal;
  Indices near;
  for (const std::size_t i : segment)
    if (normal.dot(points[i].cast<double>() - mean) < p.distance_m) near.push_back(i);
  return near;
}

}  // namespace

std::vector<std::uint8_t> gpf_ground(const Points& points, const GpfParameters& p) {
  std::vector<std::uint8_t> result(points.size(), 0);
  if (points.empty()) return result;
  const auto [least, greatest] = std::minmax_element(
      points.begin(), points.end(), [](const Eigen::Vector3f& a, const Eigen::Vector3f& b) { return a.x() < b.x(); });
  const float low = least->x(), width = std::max((greatest->x() - low) / static_cast<float>(p.segments), 1e-3f);
  std::vector<Indices> segments(static_cast<std::size_t>(p.segments));
  const double lowest = p.sensor_height_m > 0 ? -1.5 * p.sensor_height_m : -1e9;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (static_cast<double>(points[i].z()) < lowest) continue;
    const int k = std::min(static_cast<int>((points[i].x() - low) / width), p.segments - 1);
    segments[static_cast<std::size_t>(k)].push_back(i);
  }
  for (const Indices& segment : segments) {
    Indices ground = seeds_of(points, segment, p);
    for (int i = 0; i < p.iterations && ground.size() >= 3; ++i) ground = near_plane(points, segment, ground, p);
    for (const std::size_t i : ground) result[i] = 1;
  }
  return result;
}

}  // namespace btms::bench
