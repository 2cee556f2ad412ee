// Drift along z, the limit that the paper names (V): scans that overlap saw the same ground, so their poses are
// corrected in height, roll and pitch until it is one surface again.
#pragma once

#include <span>
#include <vector>

#include "engine/pose.h"
#include "engine/terrain/segmentation.h"
#include "engine/tiling/point_source.h"
#include "engine/tiling/progress.h"

namespace btms {

// The mean of a scan's terrain points in a cell of half a metre, in the sensor's frame.
struct GroundPatch {
  float x_m, y_m, z_m;
};

// Of one scan, from its points and their labels; no further than kGroundRange_m from the sensor, where beams still meet
// the ground steeply enough. At most some 8,000.
inline constexpr double kGroundRange_m = 25;
std::vector<GroundPatch> ground_patches(const PointBlock& points, std::span<const Label> labels);

struct AlignedPoses {
  std::vector<Pose> poses;
  // How far apart scans see the ground of one place: over squares of half a metre that at least three scans saw, the
  // median of the distance from the lowest scan to the highest (of 64, where more saw it). 0 where there are no such
  // squares.
  double smear_before_m = 0, smear_after_m = 0;
  double largest_m = 0;      // of the corrections, in height
  double largest_slope = 0;  // and in roll and pitch: the tangent of the angle
};

// `ground[i]` was seen from poses[i], whose z axis points about upwards. A robust least-squares problem: one plane a
// square of half a metre, three numbers a scan, linear but for the rotation. The first pose stays. Places keep their x
// and y, up to what a rotation about the sensor moves the points. Serial and without transcendental functions, so
// the same bits for the same input. Throws Error(kCancelled) between two solves when `progress` asks for it.
AlignedPoses align_ground(std::span<const std::vector<GroundPatch>> ground, std::span<const Pose> poses,
                          Progress& progress);

}  // namespace btms
