// A storey of a building: corridors, rooms on two levels joined by steps or a ramp, furniture, walls, and a ceiling
// over everything that takes half of the returns.
#include <algorithm>
#include <cmath>

#include "engine/scenes/random.h"
#include "engine/scenes/world.h"

namespace btms {
namespace {

constexpr double kRoom_x_m = 8, kRoom_y_m = 7;  // a room with its walls
constexpr double kCorridor_m = 2.4;             // between every second row of rooms
constexpr double kStripe_m = 2 * kRoom_y_m + kCorridor_m;
constexpr double kWallHalf_m = 0.075, kDoor_m = 1;
constexpr double kRaised_m = 0.45, kRiser_m = 0.15, kTread_m = 0.3, kRampSlope = 0.125;
constexpr double kCeiling_m = 3.2;

enum class Floor : std::uint8_t { kLevel, kSteps, kRamp };

// A room by its column and its row; doors open to the corridor between rows 2k (north of it) and 2k - 1 (south of it).
struct Room {
  std::int64_t i, j;
  double x0_m, y0_m;  // south-west corner
  bool door_south;
};

class Indoor final : public World {
 public:
  explicit Indoor(std::uint64_t seed) : seed_(mix(seed ^ 0x1d00)) {}

  double ground_m(double x, double y) const override {
    const double stripe = std::floor(y / kStripe_m), in = y - stripe * kStripe_m - kCorridor_m;
    if (in < 0) return 0;  // the corridor
    const bool south_half = in < kRoom_y_m;
    const double inside = south_half ? in : 2 * kRoom_y_m - in;  // from the corridor's wall
    const auto i = static_cast<std::int64_t>(std::floor(x / kRoom_x_m));
    const auto j = 2 * static_cast<std::int64_t>(stripe) + (south_half ? 0 : 1);
    switch (floor(i, j)) {
      case Floor::kSteps:
        return std::min(kRaised_m, kRiser_m * std::max(0.0, std::floor((inside - 1) / kTread_m) + 1));
      case Floor::kRamp:
        return std::clamp((inside - 1) * kRampSlope, 0.0, kRaised_m);
      default:
        return 0;
    }
  }

  void place(const Box& box, std::vector<Object>& objects) const override {
    Placer placer(*this, box, objects);
    const auto cell = [](double v, double edge) { return static_cast<std::int64_t>(std::floor(v / edge)); };
    for (std::int64_t k = cell(box.y0_m - 1, kStripe_m); k <= cell(box.y1_m + 1, kStripe_m); ++k)
      for (std::int64_t i = cell(box.x0_m - 1, kRoom_x_m); i <= cell(box.x1_m + 1, kRoom_x_m); ++i) {
        const double x = static_cast<double>(i) * kRoom_x_m, y = static_cast<double>(k) * kStripe_m;
        Object ceiling{.label = SceneClass::kCeiling,
                       .half_s_m = kRoom_x_m / 2,
                       .half_t_m = kStripe_m / 2,
                       .height_m = kCeiling_m,
                       .opacity = 0.5};
        ceiling.frame = {.x_m = x + kRoom_x_m / 2, .y_m = y + kStripe_m / 2};
        placer.add_at(ceiling, 0);
        room({i, 2 * k, x, y + kCorridor_m, true}, placer);
        room({i, 2 * k + 1, x, y + kCorridor_m + kRoom_y_m, false}, placer);
      }
  }

 private:
  Floor floor(std::int64_t i, std::int64_t j) const {
    const std::uint64_t h = hash_at(seed_ + 1, i, j) % 5;
    return h == 0 ? Floor::kSteps : h == 1 ? Floor::kRamp : Floor::kLevel;
  }

  static void wall(double x0, double y0, double x1, double y1, Placer& placer) {
    Object o{.label = SceneClass::kBuilding,
             .half_s_m = (x1 - x0) / 2 + kWallHalf_m,
             .half_t_m = (y1 - y0) / 2 + kWallHalf_m,
             .height_m = kCeiling_m - 0.02,
             .scatter_m = kCeiling_m};
    o.frame = {.x_m = (x0 + x1) / 2, .y_m = (y0 + y1) / 2};
    placer.add_at(o, 0);
  }

  void room(const Room& r, Placer& placer) const {
    Random random(hash_at(seed_ + 2, r.i, r.j));
    const double x1 = r.x0_m + kRoom_x_m, y1 = r.y0_m + kRoom_y_m;
    wall(r.x0_m, r.y0_m, r.x0_m, y1, placer);
    if (r.door_south) wall(r.x0_m, y1, x1, y1, placer);  // towards the room behind
    const double front = r.door_south ? r.y0_m : y1, door = r.x0_m + random.uniform(1, kRoom_x_m - 1 - kDoor_m);
    wall(r.x0_m, front, door, front, placer);
    wall(door + kDoor_m, front, x1, front, placer);

    // Furniture keeps to the back of the room, clear of steps and ramps.
    const double back0 = r.door_south ? r.y0_m + 4.9 : r.y0_m + 0.7, back1 = back0 + 1.4;
    const double to_door = r.door_south ? -1 : 1;
    for (double x = r.x0_m + 0.9; x < x1 - 1; x += random.uniform(1.9, 2.8)) {
      const double y = random.uniform(back0, back1), half_s = random.uniform(0.5, 0.75);
      if (random.chance(0.55)) {  // a table: a thin top that lets something through beside its edges
        furniture(x, y, half_s, random.uniform(0.35, 0.5), 0.74, 0.85, 0.02, placer);
        furniture(x + 0.2, y + 0.75 * to_door, 0.24, 0.24, 0.46, 0.9, 0.1, placer);  // its chair
      } else {
        furniture(x, y, half_s - 0.15, 0.25, random.uniform(0.9, 2.1), 1, 0.1, placer);  // a cupboard
      }
    }
  }

  static void furniture(double x, double y, double half_s, double half_t, double height, double opacity, double scatter,
                        Placer& placer) {
    Object o{.follows_ground = false,
             .half_s_m = half_s,
             .half_t_m = half_t,
             .height_m = height,
             .opacity = opacity,
             .scatter_m = scatter};
    o.frame = {.x_m = x, .y_m = y};
    placer.add(o);
  }

  std::uint64_t seed_;
};

}  // namespace

std::unique_ptr<World> make_indoor(std::uint64_t seed) { return std::make_unique<Indoor>(seed); }

}  // namespace btms
