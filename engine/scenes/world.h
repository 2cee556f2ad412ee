// A world without end, in local metres (x east, y north, from the scene's south-west corner): the bare ground and what
// stands on it. How it is seen is another matter (airborne.h).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/scenes/object.h"

namespace btms {

// How a world is scanned.
struct Survey {
  double density_per_m2 = 10;  // unless the options say otherwise
  double deviation_m = 0.02;   // of ground points
  bool slanted = false;        // pulses come slant() off plumb and are stopped by walls; else plumb
};

// Immutable, thread-safe, pure in (seed, place).
class World {
 public:
  virtual ~World() = default;
  // Exact height of the bare terrain.
  virtual double ground_m(double x_m, double y_m) const = 0;
  // Appends every object that meets the box, in an order that does not depend on the box.
  virtual void place(const Box& box, std::vector<Object>& objects) const = 0;
  virtual Survey survey() const { return {}; }
  // Where a place lies on a carriageway that belongs to a net of streets, its height: of the ground, or of a bridge.
  virtual std::optional<double> street_m(double /*x_m*/, double /*y_m*/) const { return std::nullopt; }
  // The share of pulses that come from a vehicle below all decks.
  virtual double from_below(double /*x_m*/, double /*y_m*/) const { return 0; }
};

// The world of a scene by its name. Throws Error(kUsage) for an unknown one, naming those there are.
std::unique_ptr<World> make_world(const std::string& name, std::uint64_t seed);

std::unique_ptr<World> make_city(std::uint64_t seed);
std::unique_ptr<World> make_hills(std::uint64_t seed);
std::unique_ptr<World> make_quarry(std::uint64_t seed);
std::unique_ptr<World> make_bumpy(std::uint64_t seed);
std::unique_ptr<World> make_indoor(std::uint64_t seed);
std::unique_ptr<World> make_forest(std::uint64_t seed);
std::unique_ptr<World> make_halls(std::uint64_t seed);
std::unique_ptr<World> make_hillside(std::uint64_t seed);
std::unique_ptr<World> make_overpass(std::uint64_t seed);

// Collects the objects that meet a box; the ground below one is asked for only when it is kept.
class Placer {
 public:
  Placer(const World& world, const Box& box, std::vector<Object>& objects)
      : world_(world), box_(box), objects_(objects) {}

  bool wants(const Box& b) const { return box_.meets(b); }
  void add(const Object& o) {
    if (!wants(o.bounds())) return;
    add_at(o, o.follows_ground ? 0 : world_.ground_m(o.frame.x_m, o.frame.y_m));
  }
  // For a part of a larger object: its heights count from where those of the whole do.
  void add_on(const Object& part, const Object& whole) {
    if (wants(part.bounds())) add_at(part, world_.ground_m(whole.frame.x_m, whole.frame.y_m));
  }
  void add_at(Object o, double base_m) {
    if (!wants(o.bounds())) return;
    o.base_m = base_m;
    objects_.push_back(o);
  }

 private:
  const World& world_;
  Box box_;
  std::vector<Object>& objects_;
};

}  // namespace btms
