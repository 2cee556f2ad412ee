// Synthetic worlds with an exact analytic surface and labels: city, hills, quarry, bumpy, indoor, forest,
// halls, hillside, overpass.
//
// A scene is a pure function of its name, seed and size: the same points on every machine (no libm transcendental, no
// std:: distribution, whose output differs between libraries; no contraction of a * b + c).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
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
  // Pulses per square metre, before occlusion (default: the scene's own, 10; forest 25).
  std::optional<double> density_per_m2 = std::nullopt;
  std::uint64_t points = 1'000'000;       // the scene's area follows: points / density
  double origin_x_m = 0, origin_y_m = 0;  // south-west corner in the map frame
};

// Why the terrain of a place is easy or hard to see from the air. Of several that hold the last counts.
enum class Stratum : std::uint8_t {
  kOpen,           // nothing stands there
  kUnderPlants,    // some pulses may pass
  kHollow,         // either of these, and ground or buildings rise by 0.4 m or more within 10 m in all eight directions
  kBehindWall,     // open, but in the shadow of a wall, a cliff or a car for pulses that come slant() off plumb
  kUnderVehicle,   // or another small solid thing: boulder, log, furniture
  kUnderBuilding,  // walls count too
  kUnderBridge,    // or below another deck; whatever stands there
};
inline constexpr std::size_t kStrata = 7;

// Everything that is known of a place.
struct PlaceTruth {
  double ground_z_m = 0;            // the bare terrain, under buildings, cars and bridges too
  std::optional<double> upper_z_m;  // a second surface to walk or drive on, half a metre or more above: a deck
  SceneClass cover = SceneClass::kGround;
  Stratum stratum = Stratum::kOpen;
  bool at_step = false;  // the ground jumps by half a metre or more within half a metre: a wall, not a kerb
};

// Metres of the map frame.
struct ScenePlace {
  double x_m = 0, y_m = 0;
};

// Immutable, thread-safe. A world is cut into square blocks that can be generated in any order, each from its own seed.
class Scene {
 public:
  // Throws Error(kUsage): for an unknown name, naming the scenes there are; for a density outside 0.01..10000 per m2,
  // no points, or an area that leaves the map frame.
  static std::unique_ptr<Scene> create(const SceneOptions& options);
  static std::vector<std::string> names();
  virtual ~Scene() = default;

  virtual double origin_x_m() const = 0;  // south-west corner in the map frame, to the millimetre
  virtual double origin_y_m() const = 0;
  virtual double width_m() const = 0;   // extent in x from the origin
  virtual double height_m() const = 0;  // extent in y
  // Exact height of the bare terrain at a place of the map frame (under buildings, cars and bridges too), metres.
  virtual double ground_z_m(double x_m, double y_m) const = 0;
  // What covers the terrain at a place, looking from above: kGround where it is open. A ceiling does not count.
  virtual SceneClass cover(double x_m, double y_m) const = 0;
  // The second surface of a place, see PlaceTruth.
  std::optional<double> upper_z_m(double x_m, double y_m) const { return truth(x_m, y_m).upper_z_m; }
  Stratum stratum(double x_m, double y_m) const { return truth(x_m, y_m).stratum; }
  PlaceTruth truth(double x_m, double y_m) const;
  // truths[i] for places[i]. Fast for many places that lie together, within some ten metres. Precondition: equal sizes.
  virtual void truth(std::span<const ScenePlace> places, std::span<PlaceTruth> truths) const = 0;

  virtual std::size_t blocks() const = 0;
  // Deviation of ground points from ground_z_m: the scanner's 2 cm, and what lies on the ground (leaves, litter).
  // No point is further off than 3.5 deviations.
  virtual double ground_deviation_m() const = 0;
  // Appends the block's points to `points`, in scan-line order. Solid things hide the ground, plants let a part of the
  // pulses through. In halls, hillside and overpass pulses come slant() off plumb: they meet walls, leave shadows and
  // get some way below decks; below some decks a vehicle has scanned the road all through.
  virtual void generate(std::size_t block, std::vector<ScenePoint>& points) const = 0;
};

}  // namespace btms
