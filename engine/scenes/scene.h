// Synthetic worlds with an exact analytic surface and labels: city, hills, quarry, bumpy, indoor.
//
// A scene is a pure function of its name, seed and size: the same points on every machine (no libm transcendental, no
// std:: distribution, whose output differs between libraries; no contraction of a * b + c).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace btms {

// ASPRS classes used by the scenes.
enum class SceneClass : std::uint8_t {
  kUnclassified = 1,  // boulders, furniture, machines
  kGround = 2,
  kLowVegetation = 3,
  kHighVegetation = 5,
  kBuilding = 6,
  kLowNoise = 7,
  kBridgeDeck = 17,
  kVehicle = 64,  // user-defined range
  kCeiling = 65,
};

struct ScenePoint {
  std::int64_t x_mm = 0, y_mm = 0;
  std::int32_t z_mm = 0;
  SceneClass label = SceneClass::kGround;
};

struct SceneOptions {
  std::string name = "city";
  std::uint64_t seed = 1;
  double density_per_m2 = 10.0;           // last returns per square metre, before occlusion
  std::uint64_t points = 1'000'000;       // the scene's area follows: points / density
  double origin_x_m = 0, origin_y_m = 0;  // south-west corner in the map frame
};

// Immutable, thread-safe. A world is cut into square blocks that can be generated in any order, each from its own seed.
class Scene {
 public:
  // Throws Error(kUsage): for an unknown name, naming the scenes there are; for a density outside 0.01..10000 per m2,
  // no points, or an area that leaves the map frame.
  static std::unique_ptr<Scene> create(const SceneOptions& options);
  static std::vector<std::string> names();
  virtual ~Scene() = default;

  virtual double width_m() const = 0;   // extent in x from the origin
  virtual double height_m() const = 0;  // extent in y
  // Exact height of the bare terrain at a place of the map frame (under buildings, cars and bridges too), metres.
  virtual double ground_z_m(double x_m, double y_m) const = 0;
  // What covers the terrain at a place, looking from above: kGround where it is open. A ceiling does not count.
  virtual SceneClass cover(double x_m, double y_m) const = 0;

  virtual std::size_t blocks() const = 0;
  // Appends the block's points to `points`, in scan-line order. Ground points lie within 7 cm of ground_z_m (deviation
  // 2 cm); solid things hide the ground, plants let a part of the pulses through.
  virtual void generate(std::size_t block, std::vector<ScenePoint>& points) const = 0;
};

}  // namespace btms
