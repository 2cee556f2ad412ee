// Slopes of 10 to 30 degrees that people live on: a road on an embankment and in cuttings along the valley, houses dug
// in so that the uphill eaves nearly touch the ground, retaining walls, and terraced fields above.
#include <algorithm>
#include <cmath>

#include "engine/scenes/greenery.h"
#include "engine/scenes/noise.h"
#include "engine/scenes/scatter.h"
#include "engine/scenes/traffic.h"
#include "engine/scenes/turned_plan.h"
#include "engine/scenes/valleys.h"
#include "engine/scenes/world.h"

namespace btms {
namespace {

constexpr double kPeriod_m = 400, kRounded = 0.12, kSlope = 0.38;
constexpr double kRoad_m = 32, kRoadHalf_m = 5, kBatter = 1.5;          // how far up the valley's side; run per rise
constexpr double kLots_m = 56, kLot_v = 30, kLot_u = 23, kLotRows = 2;  // the houses
constexpr double kFields0_m = 122, kFields1_m = 190, kField_u = 120;    // the terraces
constexpr double kWall_m = 0.12;                                        // the width on the ground of what is upright

// Plan coordinates measured from the valley: up the side, and which side.
struct Side {
  double up_m;
  double sign;
  double valley_v;
  std::int64_t id() const { return 2 * static_cast<std::int64_t>(valley_v) + (sign > 0 ? 1 : 0); }
};

Side side_of(double v) {
  const double valley = std::floor(v / kPeriod_m + 0.5) * kPeriod_m;
  return {std::abs(v - valley), v < valley ? -1.0 : 1.0, valley};
}

enum class Dug : std::uint8_t { kBuried, kFrontTerrace, kBackYard };

struct Lot {
  double u_m, up_m;  // centre of the house
  double half_u_m, half_up_m;
  Dug dug;
  bool flat;
  std::uint64_t seed;
};

class Hillside final : public World {
 public:
  explicit Hillside(std::uint64_t seed)
      : seed_(mix(seed ^ 0x51de)), spur_(seed_ + 1, 95), fine_(seed_ + 2, 9), road_(seed_ + 3, 75) {}

  double ground_m(double x, double y) const override {
    const PlanPlace p = to_plan(x, y);
    const Side side = side_of(p.v_m);
    const double natural = natural_m(x, y);
    if (side.up_m > kFields0_m && side.up_m < kFields1_m) return fields_m(p.u_m, side, natural);
    if (side.up_m > kLots_m && side.up_m < kLots_m + kLot_v * kLotRows) return lot_m(p.u_m, side, natural);
    return side.sign > 0 ? with_road_m(p.u_m, side, natural) : natural;
  }

  void place(const Box& box, std::vector<Object>& objects) const override {
    Placer placer(*this, box, objects);
    const Box plan = plan_box(box.grown(10));
    const auto cell = [](double v, double pitch) { return static_cast<std::int64_t>(std::floor(v / pitch)); };
    for (std::int64_t k = cell(plan.y0_m, kPeriod_m) - 1; k <= cell(plan.y1_m, kPeriod_m) + 1; ++k)
      for (int s = 0; s < 2; ++s) {
        const Side side{0, s == 0 ? -1.0 : 1.0, static_cast<double>(k) * kPeriod_m};
        for (std::int64_t i = cell(plan.x0_m, kLot_u) - 1; i <= cell(plan.x1_m, kLot_u) + 1; ++i) {
          for (int row = 0; row < kLotRows; ++row) house(lot(i, row, side), side, placer);
          if (side.sign > 0) cars(static_cast<double>(i) * kLot_u, side, hash_at(seed_ + 7, i, k), placer);
        }
      }
    scatter(seed_ + 8, 8, box, 8, [&](double x, double y, Random& random) {
      const double up = side_of(to_plan(x, y).v_m).up_m;
      const bool wood = up > kFields1_m || up<14, garden = up> kLots_m - 6 && up < kFields0_m - 4;
      if (random.chance(wood ? 0.8 : garden ? 0.22 : 0))
        placer.add(tree({.x_m = x, .y_m = y}, random, 4, wood ? 18 : 10, 0.75));
    });
    scatter(seed_ + 9, 6, box, 2, [&](double x, double y, Random& random) {
      if (random.chance(0.25)) placer.add(bush({.x_m = x, .y_m = y}, random));
    });
  }

  Survey survey() const override { return {.slanted = true}; }

 private:
  static Frame frame(const Side& side, double u, double up) { return plan_frame(u, side.valley_v + side.sign * up); }

  double natural_m(double x, double y) const {
    const double side = valley_side(to_plan(x, y).v_m, kPeriod_m, kRounded);
    return 250 + kSlope * side + 5 * spur_.at(x, y) + 0.15 * fine_.at(x, y);
  }

  // On a bank where it is above the slope, in a cutting where it is below.
  double with_road_m(double u, const Side& side, double natural) const {
    const double level = 250 + kSlope * valley_side(kRoad_m, kPeriod_m, kRounded) + 2 + 5 * road_.at(u);
    const double off = std::max(0.0, std::abs(side.up_m - kRoad_m) - kRoadHalf_m) / kBatter;
    return std::clamp(natural, level - off, level + off);
  }

  // Level treads and upright walls; fields of different steps meet in walls too.
  double fields_m(double u, const Side& side, double natural) const {
    const auto field = static_cast<std::int64_t>(std::floor(u / kField_u));
    const double step = 1 + 2 * unit(hash_at(seed_ + 4, field, side.id()));
    const double a = natural / step, tread = std::floor(a), t = a - tread;
    const double wall = kWall_m * kSlope / step;  // its share of a step
    const double level = step * (tread + 0.05 * t + 0.95 * clamp_unit((t - 1 + wall) / wall));
    const double share = clamp_unit(std::min(side.up_m - kFields0_m, kFields1_m - side.up_m) / 5);
    return natural + share * (level - natural);
  }

  Lot lot(std::int64_t i, std::int64_t row, const Side& side) const {
    Random random(hash_at(hash_at(seed_ + 5, i, row), side.id()));
    Lot l{};
    l.half_u_m = random.uniform(5, 7.5);
    l.half_up_m = random.uniform(4.2, 5.5);
    l.u_m = (static_cast<double>(i) + 0.5) * kLot_u + random.uniform(-1.5, 1.5);
    l.up_m = kLots_m + (static_cast<double>(row) + 0.5) * kLot_v + random.uniform(-2, 2);
    l.dug = static_cast<Dug>(random.below(3));
    l.flat = random.chance(0.35);
    l.seed = random.bits();
    return l;
  }

  double natural_of(const Side& side, double u, double up) const {
    const Frame f = frame(side, u, up);
    return natural_m(f.x_m, f.y_m);
  }

  // A terrace in front of a house, held by walls, or a yard dug out behind it.
  double lot_m(double u, const Side& side, double natural) const {
    const Lot l = lot(static_cast<std::int64_t>(std::floor(u / kLot_u)),
                      static_cast<std::int64_t>((side.up_m - kLots_m) / kLot_v), side);
    const double aside = l.half_u_m + 1 - std::abs(u - l.u_m);
    const double below = l.up_m - l.half_up_m - side.up_m, behind = side.up_m - l.up_m - l.half_up_m;
    if (aside < 0 || l.dug == Dug::kBuried) return natural;
    if (l.dug == Dug::kFrontTerrace) {
      if (below < 0 || below > 5) return natural;
      const double level = natural_of(side, l.u_m, l.up_m - l.half_up_m);
      return natural + (level - natural) * clamp_unit(std::min(aside, 5 - below) / kWall_m);
    }
    if (behind < 0 || behind > 3) return natural;
    const double level = natural_of(side, l.u_m, l.up_m);
    return natural + (level - natural) * clamp_unit(std::min(aside, 3 - behind) / kWall_m);
  }

  void house(const Lot& l, const Side& side, Placer& placer) const {
    Random random(l.seed);
    Object o{.form = l.flat ? Form::kSlab : Form::kGable, .label = SceneClass::kBuilding};
    o.frame = frame(side, l.u_m, l.up_m);
    o.half_s_m = l.half_u_m;
    o.half_t_m = l.half_up_m;
    if (!placer.wants(o.bounds())) return;
    // The ground at the uphill wall, above the ground at the centre.
    const double rise = natural_of(side, l.u_m, l.up_m + l.half_up_m) - natural_of(side, l.u_m, l.up_m);
    const double eaves = l.dug == Dug::kBackYard ? rise + 1.5 + random.uniform(0, 1.5) : rise + random.uniform(0, 0.6);
    o.eaves_m = l.flat ? 0 : std::max(1.0, eaves);
    o.height_m = std::max(1.0, eaves) + (l.flat ? 0 : random.uniform(0.4, 0.8) * l.half_up_m);
    placer.add(o);
  }

  void cars(double u, const Side& side, std::uint64_t seed, Placer& placer) const {
    Random random(seed);
    if (!random.chance(0.5)) return;
    const double lane = random.chance(0.5) ? 2.0 : -2.0, along = random.uniform(0, kLot_u);
    placer.add(car(frame(side, u + along, kRoad_m + lane), random));
  }

  std::uint64_t seed_;
  Noise spur_, fine_, road_;
};

}  // namespace

std::unique_ptr<World> make_hillside(std::uint64_t seed) { return std::make_unique<Hillside>(seed); }

}  // namespace btms
