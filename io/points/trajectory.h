// Trajectories of a sensor, as text.
#pragma once

#include <filesystem>
#include <vector>

#include "engine/tiling/trajectory.h"

namespace btms {

// One pose a line, in the frame of the points, metres; lines that start with # and empty ones are skipped. By the
// number of columns: 3 x y z; 8 TUM (time x y z quaternion); 12 KITTI (a 3 x 4 matrix, row by row: the frame must be
// the map's, not the camera's). Throws Error(kBadInput) naming file and line, also where a pose is not finite or too
// far out for a map, and where there is none.
std::vector<TrajectoryPoint> read_trajectory(const std::filesystem::path& file);

}  // namespace btms
