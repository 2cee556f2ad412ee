// A drive through a scene with a spinning scanner on the roof: scans, where they were made, and where a robot that
// drifts believes that they were.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/pose.h"
#include "engine/scenes/scene.h"
#include "engine/scenes/world.h"

namespace btms {

struct DriveOptions {
  std::size_t scans = 100;
  int beams = 64;
  int azimuths = 1024;                  // rays of a beam, a turn
  double up_deg = 2, down_deg = -24.8;  // of the highest and the lowest beam
  double range_m = 80;
  double noise_m = 0.02;          // of ranges, 1 sigma; none is further off than 3.5
  double step_m = 1;              // between scans, along the path
  double sensor_height_m = 1.73;  // above the ground, along the vehicle's own upright
  double drift_deg = 0.4;         // how far roll and pitch of the drifting poses stray; the height follows the pitch
};

// A return, in the sensor's frame: x ahead, y to the left, z up.
struct DrivePoint {
  float x_m, y_m, z_m;
  float intensity;      // 0..1
  std::uint32_t label;  // a class of SemanticKITTI
};

// Immutable, thread-safe. A pure function of its options: the same bits on every machine, as for scenes.
class Drive {
 public:
  // Throws Error(kUsage) as Scene::create() does, and where there is no room to drive.
  Drive(const SceneOptions& scene, const DriveOptions& drive);
  // Through any world, within the area; its local metres are the map frame's.
  Drive(std::unique_ptr<World> world, const Box& area, std::uint64_t seed, const DriveOptions& drive);

  // Of the sensor, in the map frame. The drive lies within the scene's area and follows a closed path, several times
  // where it is long enough.
  std::span<const Pose> poses() const { return poses_; }
  // Roll, pitch and height have strayed smoothly since the first scan.
  std::span<const Pose> drifting_poses() const { return drifting_; }

  // Appends the returns of a scan for every i in [first, last) to scans[i - first], beam by beam from the highest.
  // Scans that follow each other are cheaper together. The first thing that a ray meets returns it (Surroundings).
  void scan(std::size_t first, std::size_t last, std::span<std::vector<DrivePoint>> scans) const;

 private:
  void make_poses(const std::vector<ScenePlace>& route);
  void make_drift();

  DriveOptions options_;
  std::uint64_t seed_;
  std::unique_ptr<World> world_;
  std::vector<Pose> poses_, drifting_;
  std::vector<std::array<double, 3>> places_;  // of poses_, from the scene's corner: the same wherever that is
  std::vector<std::array<double, 3>> rays_;    // unit vectors in the sensor's frame
};

}  // namespace btms
