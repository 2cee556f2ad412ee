// Smooth hills with slopes to 35 degrees, woods on a part of them, boulders.
#include "engine/scenes/greenery.h"
#include "engine/scenes/noise.h"
#include "engine/scenes/scatter.h"
#include "engine/scenes/world.h"

namespace btms {
namespace {

class Hills final : public World {
 public:
  explicit Hills(std::uint64_t seed)
      : seed_(mix(seed ^ 0x4111)),
        large_(seed_ + 1, 230),
        small_(seed_ + 2, 70),
        fine_(seed_ + 3, 17),
        wood_(seed_ + 4, 110) {}

  double ground_m(double x, double y) const override {
    return 150 + 38 * large_.at(x, y) + 4.2 * small_.at(x, y) + 0.25 * fine_.at(x, y);
  }

  void place(const Box& box, std::vector<Object>& objects) const override {
    Placer placer(*this, box, objects);
    scatter(seed_ + 5, 4.5, box, 8, [&](double x, double y, Random& random) {
      if (wood_.at(x, y) + 0.25 * random.uniform(-1, 1) > 0.05)
        placer.add(tree({.x_m = x, .y_m = y}, random, 8, 22, 0.8));
    });
    scatter(seed_ + 6, 7, box, 2, [&](double x, double y, Random& random) {
      if (random.chance(0.5)) placer.add(bush({.x_m = x, .y_m = y}, random));
    });
    scatter(seed_ + 7, 18, box, 4, [&](double x, double y, Random& random) {
      if (random.chance(0.6)) placer.add(boulder(turned(x, y, random), random, 2.5));
    });
  }

 private:
  std::uint64_t seed_;
  Noise large_, small_, fine_, wood_;
};

}  // namespace

std::unique_ptr<World> make_hills(std::uint64_t seed) { return std::make_unique<Hills>(seed); }

}  // namespace btms
