// Poses of a sensor, from text files as odometry writes them.
#pragma once

#include <filesystem>
#include <vector>

#include "engine/pose.h"

namespace btms {

// One pose a line, metres. By the number of columns: 12 KITTI (the upper three rows of a matrix, row by row), 8 TUM
// (time x y z and a quaternion x y z w of any length but 0). Throws Error as read_number_lines() does, and
// Error(kBadInput) naming file and line where a number is not finite, a place is too far out for a map, or a matrix is
// no rotation.
std::vector<Pose> read_poses(const std::filesystem::path& file);

// The line `Tr:` (or `Tr_velo_to_cam:`) of a KITTI calibration: from the scanner's frame to the frame the poses are
// of. Throws Error(kBadInput) where there is none or it is no rotation and place; Error(kUsage) where there is no file.
Pose read_calibration(const std::filesystem::path& file);

}  // namespace btms
