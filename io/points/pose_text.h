// Poses as text, for files.
#pragma once

#include <span>
#include <string>

#include "engine/pose.h"

namespace btms {

// KITTI: a line a pose, the upper three rows of the matrix from sensor to map, row by row. Numbers are written with as
// many digits as make them the same when they are read.
std::string kitti_poses(std::span<const Pose> poses);

// TUM: time in seconds, place, unit quaternion x y z w; pose i at i * interval_s.
std::string tum_poses(std::span<const Pose> poses, double interval_s);

}  // namespace btms
