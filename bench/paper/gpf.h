// GPF, ground plane fitting (Zermas, Izzat and Papanikolopoulos 2017): the cloud is cut into segments along x; in each
// a plane starts from the lowest points and is fitted again to what lies near it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace btms::bench {

// As published for KITTI.
struct GpfParameters {
  int segments = 3;         // N_segs
  int iterations = 3;       // N_iter
  int lowest_points = 20;   // N_LPR: their mean height is where seeds are looked for
  double seeds_m = 0.4;     // Th_seeds: seeds lie up to this far above it
  double distance_m = 0.2;  // Th_dist: ground lies up to this far above the plane
  // Of the sensor, at z = 0, above ground: as in the released code, points below -1.5 times it are errors and don't
  // count. 0: all points count, as in maps, where nobody knows it.
  double sensor_height_m = 0;
};

// 1 ground, 0 not, for every point; metres, x forward, z up.
std::vector<std::uint8_t> gpf_ground(const std::vector<Eigen::Vector3f>& points, const GpfParameters& p = {});

}  // namespace btms::bench
