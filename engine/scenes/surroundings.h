// What can be seen of a world from a place on its ground, ray by ray.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/scenes/body.h"

namespace btms {

// Local metres. The direction is of unit length.
struct Ray {
  double x_m = 0, y_m = 0, z_m = 0;
  double dx = 1, dy = 0, dz = 0;
};

struct RayHit {
  double range_m = 0;
  const Object* object = nullptr;  // none: the terrain
  bool on_top = false;             // of a plate, not on its side or from below
};

// The ground's bounds and the bodies of a box, in cells, so that a ray asks for the exact ground and the exact bodies
// only where it may meet them. What it meets does not depend on the box. Immutable, thread-safe; the world must outlive
// it. Memory: 64 bytes a square metre.
class Surroundings {
 public:
  Surroundings(const World& world, const Box& box);

  // The first thing a ray meets, to a hundredth of a millimetre. Terrain and whatever is not a plant stop every ray.
  // The leaves of a plant fill a share of small cubes in it, always the same ones, and stop what enters these. Nothing
  // is seen of leaves within a metre: the vehicle pushes them aside. Of the ground, spikes and dents narrower than 7 cm
  // may be missed. Precondition: the ray keeps within the box, starting above ground and outside of bodies.
  std::optional<RayHit> first_hit(const Ray& ray, double range_m) const;

 private:
  struct Target {
    Body body;
    Extent bounds;          // heights
    double step_m = 0;      // along the ray; kLeaves: of the cubes
    double leaf_share = 0;  // of cubes that are filled
    std::uint64_t seed = 0;
  };
  struct Block {
    Extent ground;
    double high_m = 0;  // with bodies
    std::uint32_t targets_begin = 0, targets_end = 0;
  };

  std::size_t sample(std::int64_t i, std::int64_t j) const {
    return static_cast<std::size_t>((j - first_y_) * samples_x_ + i - first_x_);
  }
  const Block* block(std::int64_t i, std::int64_t j) const;
  void sample_ground();
  void place_targets();
  Target target(const Body& body) const;
  double ground_hit(const Ray& ray, double from_m, double to_m) const;
  double target_hit(const Target& t, const Ray& ray, double from_m, double to_m) const;

  const World& world_;
  std::int64_t first_x_, first_y_;  // cell of the first sample, absolute
  std::int64_t blocks_x_, blocks_y_, samples_x_, samples_y_;
  std::vector<float> ground_m_;  // at the cells' corners
  std::vector<Target> targets_;
  std::vector<std::uint32_t> items_;
  std::vector<Block> blocks_;
};

}  // namespace btms
