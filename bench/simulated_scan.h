// What a spinning scanner on a car would see of a scene: for every ray the nearest point, in the sensor's frame.
#pragma once

#include <vector>

#include "engine/scenes/scene.h"

namespace btms::bench {

struct SensorPlace {
  double x_m = 0, y_m = 0, z_m = 0;
};

// 64 beams of +2 to -24.8 degrees, 2048 azimuths. `points` must be much denser than the rays.
std::vector<ScenePoint> simulate_scan(const std::vector<ScenePoint>& points, const SensorPlace& sensor);

}  // namespace btms::bench
