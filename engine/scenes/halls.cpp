// Very large flat halls, some with an embankment up to the roof behind them, docks and ramps for lorries in front, and
// parking lots.
#include <algorithm>
#include <cmath>

#include "engine/scenes/greenery.h"
#include "engine/scenes/noise.h"
#include "engine/scenes/scatter.h"
#include "engine/scenes/traffic.h"
#include "engine/scenes/turned_plan.h"
#include "engine/scenes/world.h"

namespace btms {
namespace {

constexpr double kPitch_u = 330, kPitch_v = 250;  // a site
constexpr double kFront_v = 42;                   // of a hall's southern wall, in its site
constexpr double kTop_m = 14, kBatter = 1.5;      // an embankment: the width of its top, run per rise of its sides
constexpr double kDock_m = 14, kDockDepth_m = 1.2, kDockRise_m = 1.2, kRampWidth_m = 4, kRamp_m = 13;
constexpr double kWall_m = 0.1;  // the width on the ground of what is upright

// A site by its hall, in plan coordinates.
struct Site {
  double u_m, v_m;  // centre
  double half_u_m, half_v_m, height_m;
  bool embanked;
  double bank_m;            // height of the embankment's top above the ground
  double dock0_m, dock1_m;  // range in u of the docks, from the centre
  std::uint64_t seed;
};

class Halls final : public World {
 public:
  explicit Halls(std::uint64_t seed) : seed_(mix(seed ^ 0x4a115)), plain_(seed_ + 1, 350), rough_(seed_ + 2, 25) {}

  double ground_m(double x, double y) const override {
    const PlanPlace p = to_plan(x, y);
    const Site s = site(cell(p.u_m, kPitch_u), cell(p.v_m, kPitch_v));
    const double u = p.u_m - s.u_m, v = p.v_m - s.v_m;
    return plain_m(x, y) + bank_m(s, u, v - s.half_v_m) + dock_m(s, u, -s.half_v_m - v);
  }

  void place(const Box& box, std::vector<Object>& objects) const override {
    Placer placer(*this, box, objects);
    const Box plan = plan_box(box.grown(10));
    for (std::int64_t j = cell(plan.y0_m, kPitch_v); j <= cell(plan.y1_m, kPitch_v); ++j)
      for (std::int64_t i = cell(plan.x0_m, kPitch_u); i <= cell(plan.x1_m, kPitch_u); ++i) fill(site(i, j), placer);
  }

  Survey survey() const override { return {.slanted = true}; }

 private:
  static std::int64_t cell(double v, double pitch) { return static_cast<std::int64_t>(std::floor(v / pitch)); }
  double plain_m(double x, double y) const { return 60 + 0.8 * plain_.at(x, y) + 0.03 * rough_.at(x, y); }

  Site site(std::int64_t i, std::int64_t j) const {
    Random random(hash_at(seed_ + 3, i, j));
    Site s{};
    s.half_u_m = random.uniform(60, 149);
    s.half_v_m = random.uniform(34, 75);
    s.height_m = random.uniform(8, 15);
    s.u_m = (static_cast<double>(i) + 0.5) * kPitch_u;
    s.v_m = static_cast<double>(j) * kPitch_v + kFront_v + s.half_v_m;
    s.embanked = (i + 2 * j) % 2 == 0;  // every second one, so that a small map has both
    s.bank_m = s.height_m - random.uniform(0, 0.4);
    s.dock0_m = random.uniform(-0.8, -0.2) * s.half_u_m;
    s.dock1_m = s.dock0_m + random.uniform(30, 60);
    s.seed = random.bits();
    return s;
  }

  // Behind the northern wall, `behind` metres away from it.
  static double bank_m(const Site& s, double u, double behind) {
    if (!s.embanked || behind < 0) return 0;
    const double out = std::max(0.0, behind - kTop_m), aside = std::max(0.0, std::abs(u) - s.half_u_m);
    return std::max(0.0, s.bank_m - (out + aside) / kBatter) * clamp_unit(behind / kWall_m);
  }

  // In front of the southern wall: the ground falls to the docks between walls; beside them a ramp rises to the doors.
  static double dock_m(const Site& s, double u, double before) {
    if (before < 0 || before > kDock_m) return 0;
    const double within = std::min(u - s.dock0_m, s.dock1_m - u);
    if (within > 0) return -kDockDepth_m * clamp_unit((kDock_m - before) / kDock_m) * clamp_unit(within / kWall_m);
    const double along = u - s.dock1_m - 1, beside = std::min(before, kRampWidth_m - before);
    if (along < 0 || along > kRamp_m + 3 || beside < 0) return 0;
    return kDockRise_m * clamp_unit((kRamp_m + 3 - along) / kRamp_m) * clamp_unit(beside / kWall_m) *
           clamp_unit(along / kWall_m);
  }

  void fill(const Site& s, Placer& placer) const {
    Random random(s.seed);
    hall(s, random, placer);
    lorries(s, random, placer);
    const double south = -s.half_v_m, north = s.half_v_m, end = kPitch_u / 2 - 4;
    if (s.embanked)
      parking(s, -end, south - 34, 2 * end, 1, random, placer);
    else
      parking(s, -end, north + 16, 2 * end, static_cast<int>((kPitch_v - kFront_v - 2 * north - 30) / 17), random,
              placer);
    for (double u = -end; u < end; u += random.uniform(9, 14)) {  // along the road
      const Frame place = plan_frame(s.u_m + u, s.v_m + south - 39);
      if (random.chance(0.6)) placer.add(tree(place, random, 5, 10, 0.7));
    }
    for (int k = 0; k < 40; ++k) {
      const double u = random.uniform(-end, end), v = random.uniform(north + 1, kPitch_v - kFront_v - north - 8);
      if (s.embanked) placer.add(bush(plan_frame(s.u_m + u, s.v_m + v), random));
    }
  }

  void hall(const Site& s, Random& random, Placer& placer) const {
    Object o{.label = SceneClass::kBuilding, .frame = plan_frame(s.u_m, s.v_m)};
    o.half_s_m = s.half_u_m;
    o.half_t_m = s.half_v_m;
    o.height_m = s.height_m;
    const int roof = random.below(5);
    if (roof == 0) {  // two shallow pitches
      o.form = Form::kGable;
      o.eaves_m = s.height_m;
      o.height_m = s.height_m + 0.04 * s.half_v_m;
    } else if (roof == 1 && !s.embanked) {
      o.rim_width_m = 0.4;
      o.rim_height_m = random.uniform(0.3, 0.8);
    }
    const double base = plain_m(o.frame.x_m, o.frame.y_m);
    placer.add_at(o, base);
    // Rows of skylights, and boxes of machinery.
    for (double u = -s.half_u_m + 8; u < s.half_u_m - 8; u += 12) {
      for (double v = -s.half_v_m + 10; v < s.half_v_m - 10; v += 16) {
        const bool box = random.chance(0.06);
        Object top{.label = SceneClass::kBuilding, .frame = plan_frame(s.u_m + u, s.v_m + v)};
        top.half_s_m = box ? random.uniform(1, 3) : 1.2;
        top.half_t_m = box ? random.uniform(1, 3) : 2.5;
        top.height_m = o.height_m + (box ? random.uniform(1, 3) : 0.5);
        if (box || random.chance(0.85)) placer.add_at(top, base);
      }
    }
    if (random.chance(0.6)) {  // offices at the eastern end
      Object office{.label = SceneClass::kBuilding, .frame = plan_frame(s.u_m + s.half_u_m + 6, s.v_m - 8)};
      office.half_s_m = 6;
      office.half_t_m = 14;
      office.height_m = random.uniform(6, 12);
      placer.add(office);
    }
  }

  void lorries(const Site& s, Random& random, Placer& placer) const {
    for (double u = s.dock0_m + 4; u < s.dock1_m - 3; u += 4.5) {
      if (!random.chance(0.5)) continue;
      const Frame place = plan_frame(s.u_m + u, s.v_m - s.half_v_m - 8.6);
      placer.add(lorry(place.moved(0, 0, 0, 1), random));
    }
  }

  // Double rows of cars, 17 m apart with their lanes.
  static void parking(const Site& s, double u, double v, double length, int rows, Random& random, Placer& placer) {
    for (int row = 0; row < 2 * rows; ++row)
      for (double p = 1.5; p < length; p += 2.6) {
        if (!random.chance(0.65)) continue;
        const Frame place = plan_frame(s.u_m + u + p, s.v_m + v + 17 * (row / 2) + 5.2 * (row % 2));
        placer.add(car(place.moved(0, 0, 0, 1), random));
      }
  }

  std::uint64_t seed_;
  Noise plain_, rough_;
};

}  // namespace

std::unique_ptr<World> make_halls(std::uint64_t seed) { return std::make_unique<Halls>(seed); }

}  // namespace btms
