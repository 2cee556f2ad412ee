// RANSAC (Fischler and Bolles 1981): one plane for the whole cloud, the one of many random planes that most points are
// near. The plainest baseline of the paper's table.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace btms::bench {

// Neither the method's nor the B-TMS paper names values for scans: the distance is the one of the other baseline, and
// more rounds change nothing.
struct RansacParameters {
  double distance_m = 0.2;  // points this near to the plane, on either side, are ground
  int rounds = 200;
  double slope_max_deg = 45;  // steeper planes are walls
  std::uint64_t seed = 1;
};

// 1 ground, 0 not, for every point; metres, z up.
std::vector<std::uint8_t> ransac_ground(const std::vector<Eigen::Vector3f>& points, const RansacParameters& p = {});

}  // namespace btms::bench
