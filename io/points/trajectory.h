// Trajectories of a sensor, as text.
#pragma once

#include <filesystem>
#include <vector>

#include "engine/tiling/trajectory.h"

namespace btms {

// One pose a line, in the frame of the points, metres, numbers between blanks or commas; lines that start with # and
// empty ones are skipped. By the number of columns, the same on every line: 3 x y z; 8 TUM (time x y z quaternion); 12
// KITTI (a 3 x 4 matrix, row by row: the frame must be the map's, not the camera's). Throws Error(kBadInput) naming
// file and line for a line that is none of these, and where a pose is not finite or too far out for a map;
// Error(kBadInput) naming the file where there is no pose; Error(kUsage) where there is no such file, or it is too
// large; Error(kFailed) where it can't be read.
std::vector<TrajectoryPoint> read_trajectory(const std::filesystem::path& file);

}  // namespace btms
