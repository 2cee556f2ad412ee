// An extremely bumpy field, like a test ground for robots: mounds and pits 0.3 to 2 m high, 2 to 8 m apart, everywhere.
#include "engine/scenes/greenery.h"
#include "engine/scenes/noise.h"
#include "engine/scenes/scatter.h"
#include "engine/scenes/world.h"

namespace btms {
namespace {

class Bumpy final : public World {
 public:
  explicit Bumpy(std::uint64_t seed)
      : seed_(mix(seed ^ 0xb0b)),
        plain_(seed_ + 1, 90),
        wide_(seed_ + 2, 4),
        middle_(seed_ + 3, 2.2),
        narrow_(seed_ + 4, 1.1),
        rough_(seed_ + 5, 45) {}

  // Half a wavelength lies between two values of the noise.
  double ground_m(double x, double y) const override {
    const double bumps = 0.8 * wide_.at(x, y) + 0.35 * middle_.at(x, y) + 0.12 * narrow_.at(x, y);
    return 20 + 2 * plain_.at(x, y) + bumps * (0.85 + 0.35 * rough_.at(x, y));
  }

  void place(const Box& box, std::vector<Object>& objects) const override {
    Placer placer(*this, box, objects);
    scatter(seed_ + 6, 5, box, 2, [&](double x, double y, Random& random) {
      if (random.chance(0.25)) placer.add(bush({.x_m = x, .y_m = y}, random));
    });
    scatter(seed_ + 7, 9, box, 2, [&](double x, double y, Random& random) {
      if (random.chance(0.4)) placer.add(boulder(turned(x, y, random), random, 0.9));
    });
    scatter(seed_ + 8, 22, box, 6, [&](double x, double y, Random& random) {
      if (random.chance(0.5)) placer.add(tree({.x_m = x, .y_m = y}, random, 4, 12, 0.8));
    });
  }

 private:
  std::uint64_t seed_;
  Noise plain_, wide_, middle_, narrow_, rough_;
};

}  // namespace

std::unique_ptr<World> make_bumpy(std::uint64_t seed) { return std::make_unique<Bumpy>(seed); }

}  // namespace btms
