// Dense mixed forest on slopes of 10 to 35 degrees over a rough floor: crowns, understory, shrubs and ferns in patches,
// trunks, fallen logs, boulders and the pits of uprooted trees. About a fifth of the pulses reach the ground, unevenly.
#include <cmath>

#include "engine/scenes/greenery.h"
#include "engine/scenes/noise.h"
#include "engine/scenes/scatter.h"
#include "engine/scenes/valleys.h"
#include "engine/scenes/world.h"

namespace btms {
namespace {

constexpr double kValley_m = 560;                // from a valley to the next
constexpr double kSlope = 0.44, kRounded = 0.1;  // of the valleys' sides
constexpr double kPitCell_m = 14;

class Forest final : public World {
 public:
  explicit Forest(std::uint64_t seed)
      : seed_(mix(seed ^ 0xf03e57)),
        bend_(seed_ + 1, 240),
        spur_(seed_ + 2, 75),
        knoll_(seed_ + 3, 19),
        wide_(seed_ + 4, 2.4),
        middle_(seed_ + 15, 1.3),
        narrow_(seed_ + 5, 0.7),
        stand_(seed_ + 6, 34),
        growth_(seed_ + 7, 11),
        light_(seed_ + 8, 16) {}

  double ground_m(double x, double y) const override {
    const double side = valley_side(0.8 * x + 0.6 * y + 45 * bend_.at(x, y), kValley_m, kRounded);
    // Half a wavelength lies between two values of the noise.
    const double floor = 0.2 * wide_.at(x, y) + 0.09 * middle_.at(x, y) + 0.04 * narrow_.at(x, y);
    return 400 + kSlope * side + 4.5 * spur_.at(x, y) + 0.6 * knoll_.at(x, y) + floor - pit_m(x, y);
  }

  void place(const Box& box, std::vector<Object>& objects) const override {
    Placer placer(*this, box, objects);
    scatter(seed_ + 10, 4.2, box, 8, [&](double x, double y, Random& random) { crown(x, y, random, placer); });
    scatter(seed_ + 11, 3.2, box, 3, [&](double x, double y, Random& random) {
      if (random.chance(0.45 + 0.5 * growth_.at(x, y))) understory(x, y, random, placer);
    });
    scatter(seed_ + 12, 1.5, box, 2, [&](double x, double y, Random& random) {
      if (random.chance(0.1 + 0.5 * growth_.at(y, x))) shrub(x, y, random, placer);
    });
    scatter(seed_ + 13, 13, box, 8, [&](double x, double y, Random& random) {
      if (random.chance(0.5)) log(turned(x, y, random), random, placer);
    });
    scatter(seed_ + 14, 15, box, 2, [&](double x, double y, Random& random) {
      if (random.chance(0.4)) placer.add(boulder(turned(x, y, random), random, 1.3));
    });
  }

  // The scanner's 2 cm and litter.
  Survey survey() const override { return {.density_per_m2 = 25, .deviation_m = 0.045}; }

 private:
  // The hole that the roots of a fallen tree left, in one cell of seven.
  double pit_m(double x, double y) const {
    const auto i = static_cast<std::int64_t>(std::floor(x / kPitCell_m));
    const auto j = static_cast<std::int64_t>(std::floor(y / kPitCell_m));
    Random random(hash_at(seed_ + 9, i, j));
    if (!random.chance(0.15)) return 0;
    const double radius = random.uniform(1.2, 2.8), depth = radius * random.uniform(0.35, 0.55);
    const double cx = (static_cast<double>(i) + random.uniform(0.25, 0.75)) * kPitCell_m;
    const double cy = (static_cast<double>(j) + random.uniform(0.25, 0.75)) * kPitCell_m;
    const double dx = x - cx, dy = y - cy, r2 = (dx * dx + dy * dy) / (radius * radius);
    return r2 < 1 ? depth * (1 - r2) * (1 - r2) : 0;
  }

  void crown(double x, double y, Random& random, Placer& placer) const {
    if (stand_.at(x, y) > 0.62) return;  // a clearing
    Object o = tree({.x_m = x, .y_m = y}, random, 12, 30, 0);
    // Light falls through in patches.
    o.opacity = 0.38 + 0.22 * light_.at(x, y);
    o.scatter_m = o.height_m * 0.6;
    placer.add(o);
    Object trunk = o;
    trunk.half_s_m = trunk.half_t_m = 0.008 * o.height_m + 0.05;
    trunk.height_m = 0.6 * o.height_m;
    trunk.eaves_m = trunk.height_m - 0.1;
    trunk.scatter_m = trunk.height_m;
    trunk.opacity = 1;
    placer.add(trunk);
  }

  static void understory(double x, double y, Random& random, Placer& placer) {
    Object o = tree({.x_m = x, .y_m = y}, random, 1.5, 6, 0.35);
    o.eaves_m = 0.3 * o.height_m;
    o.scatter_m = 0.8 * o.height_m;
    placer.add(o);
  }

  // A bush of 0.2 to 1 m, or ferns: lower, wider and nearly closed.
  static void shrub(double x, double y, Random& random, Placer& placer) {
    Object o = bush({.x_m = x, .y_m = y}, random);
    const bool fern = random.chance(0.5);
    o.half_s_m = o.half_t_m = fern ? random.uniform(0.6, 1.3) : random.uniform(0.3, 0.8);
    o.height_m = fern ? random.uniform(0.3, 0.7) : random.uniform(0.2, 1.0);
    o.opacity = fern ? 0.7 : 0.55;
    o.scatter_m = 0.7 * o.height_m;
    placer.add(o);
  }

  static void log(const Frame& place, Random& random, Placer& placer) {
    Object o{.follows_ground = true, .frame = place};
    o.half_s_m = random.uniform(2.5, 7);
    o.half_t_m = random.uniform(0.12, 0.3);
    o.height_m = 2 * o.half_t_m;
    placer.add(o);
  }

  std::uint64_t seed_;
  Noise bend_, spur_, knoll_, wide_, middle_, narrow_, stand_, growth_, light_;
};

}  // namespace

std::unique_ptr<World> make_forest(std::uint64_t seed) { return std::make_unique<Forest>(seed); }

}  // namespace btms
