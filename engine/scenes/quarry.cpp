// Pits with cliffs and benches, a ramp down into each, spoil heaps and machines around them.
#include <algorithm>
#include <cmath>

#include "engine/scenes/greenery.h"
#include "engine/scenes/noise.h"
#include "engine/scenes/scatter.h"
#include "engine/scenes/world.h"

namespace btms {
namespace {

constexpr double kPitch_m = 300;   // from pit to pit
constexpr double kRadius_m = 105;  // of the rim, on the average
constexpr double kUneven_m = 9;    // how far the rim strays
constexpr double kBench_m = 9;     // height of a cliff
constexpr double kShelf_m = 15;    // from the foot of a cliff to the edge of the next
constexpr double kCliff_m = 2;     // how far a cliff goes forward: 77 degrees
constexpr int kBenches = 4;
constexpr double kRampHalf_m = 6, kRampTop_m = 135, kRampFoot_m = 20, kRampSide = 1.2;
constexpr double kHeapPitch_m = 40, kRepose = 0.7;

class Quarry final : public World {
 public:
  explicit Quarry(std::uint64_t seed)
      : seed_(mix(seed ^ 0x9a44)), plain_(seed_ + 1, 260), edge_(seed_ + 2, 60), rubble_(seed_ + 3, 3) {}

  double ground_m(double x, double y) const override {
    const double plain = 90 + 6 * plain_.at(x, y) + 0.12 * rubble_.at(x, y);
    const double down = pit_m(x, y);
    return down > 0 ? plain - down : plain + heaps_m(x, y);
  }

  void place(const Box& box, std::vector<Object>& objects) const override {
    Placer placer(*this, box, objects);
    scatter(seed_ + 5, 11, box, 8, [&](double x, double y, Random& random) {
      if (random.chance(0.4) && distance_m(x, y) > 150) placer.add(tree({.x_m = x, .y_m = y}, random, 5, 14, 0.75));
    });
    scatter(seed_ + 6, 9, box, 2, [&](double x, double y, Random& random) {
      if (random.chance(0.4)) placer.add(bush({.x_m = x, .y_m = y}, random));
    });
    scatter(seed_ + 7, 10, box, 2, [&](double x, double y, Random& random) {
      if (random.chance(0.4) && distance_m(x, y) < 130) placer.add(boulder(turned(x, y, random), random, 1.6));
    });
    scatter(seed_ + 8, 40, box, 10, [&](double x, double y, Random& random) {
      if (random.chance(0.4)) machine(turned(x, y, random), random, placer);
    });
  }

 private:
  struct Centre {
    double x_m, y_m, c, s;  // and the direction of the ramp
  };
  // The pit of a cell keeps clear of the cell's sides.
  Centre centre(double x, double y) const {
    const double i = std::floor(x / kPitch_m), j = std::floor(y / kPitch_m);
    Random random(hash_at(seed_ + 9, static_cast<std::int64_t>(i), static_cast<std::int64_t>(j)));
    const double cx = (i + random.uniform(0.48, 0.52)) * kPitch_m, cy = (j + random.uniform(0.48, 0.52)) * kPitch_m;
    const Frame f = turned(cx, cy, random);
    return {cx, cy, f.s_x, f.s_y};
  }
  static double distance_from(const Centre& p, double x, double y) {
    const double dx = x - p.x_m, dy = y - p.y_m;
    return std::sqrt(dx * dx + dy * dy);
  }
  double distance_m(double x, double y) const { return distance_from(centre(x, y), x, y); }

  // Depth below the plain.
  double pit_m(double x, double y) const {
    const Centre p = centre(x, y);
    const double distance = distance_from(p, x, y);
    if (distance > kRampTop_m + kRampHalf_m) return 0;  // short of the cell's sides
    const double inside = kRadius_m + kUneven_m * edge_.at(x, y) - distance;
    double depth = 0;
    for (int k = 0; k < kBenches; ++k) depth += kBench_m * clamp_unit((inside - k * (kShelf_m + kCliff_m)) / kCliff_m);
    const double dx = x - p.x_m, dy = y - p.y_m;
    const double out = p.c * dx + p.s * dy, off = std::abs(p.c * dy - p.s * dx);
    if (out < 0) return depth;
    // The ramp is cut into the rim and filled up over the benches, with slopes on both sides.
    const double ramp = kBenches * kBench_m * clamp_unit((kRampTop_m - out) / (kRampTop_m - kRampFoot_m));
    const double side = kRampSide * std::max(0.0, off - kRampHalf_m);
    return std::clamp(depth, ramp - side, ramp + side);
  }

  // Whether a circle may touch the pit or its ramp.
  bool near_pit(double x, double y, double radius_m) const {
    const Centre p = centre(x, y);
    const double dx = x - p.x_m, dy = y - p.y_m;
    const bool on_ramp = p.c * dx + p.s * dy > 0 && std::abs(p.c * dy - p.s * dx) < 2 * kRampHalf_m + radius_m;
    return distance_from(p, x, y) < (on_ramp ? kRampTop_m + kRampHalf_m : kRadius_m + kUneven_m) + radius_m;
  }

  // Cones at the angle of repose, each within its own cell.
  double heaps_m(double x, double y) const {
    const auto i = static_cast<std::int64_t>(std::floor(x / kHeapPitch_m));
    const auto j = static_cast<std::int64_t>(std::floor(y / kHeapPitch_m));
    Random random(hash_at(seed_ + 10, i, j));
    if (!random.chance(0.7)) return 0;
    const double height = random.uniform(4, 11),
                 cx = (static_cast<double>(i) + random.uniform(0.41, 0.59)) * kHeapPitch_m;
    const double cy = (static_cast<double>(j) + random.uniform(0.41, 0.59)) * kHeapPitch_m;
    if (near_pit(cx, cy, height / kRepose)) return 0;
    const double dx = x - cx, dy = y - cy;
    return std::max(0.0, height - kRepose * std::sqrt(dx * dx + dy * dy));
  }

  static void machine(const Frame& place, Random& random, Placer& placer) {
    Object body{.form = Form::kCar, .label = SceneClass::kVehicle, .follows_ground = true, .frame = place};
    body.half_s_m = random.uniform(2.5, 5);
    body.half_t_m = random.uniform(1.4, 2);
    body.height_m = random.uniform(2.8, 4);
    body.eaves_m = 0.6 * body.height_m;
    placer.add(body);
  }

  std::uint64_t seed_;
  Noise plain_, edge_, rubble_;
};

}  // namespace

std::unique_ptr<World> make_quarry(std::uint64_t seed) { return std::make_unique<Quarry>(seed); }

}  // namespace btms
