// Roads at ground level and what passes over them, so that a place has more than one surface: road bridges between
// ramps of earth, footbridges with ramps on stilts, and galleries against avalanches along a slope.
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

constexpr double kPitch_u = 210, kPitch_v = 180;  // a crossing; the roads below run along u
constexpr double kRoadHalf_m = 6, kBatter = 1.5, kWall_m = 0.12;
constexpr double kAbutment_m = 12, kCrest_m = 16, kRampFoot_m = 84;  // of a road bridge, from the road below
constexpr double kFootSpan_m = 10, kFootRamp_m = 52, kFootHalf_m = 1.6;
constexpr double kGalleryHalf_m = 38, kGallery_m = 5.4, kGalleryFront_m = 5;  // length; roof at the slope and in front
constexpr double kCut_m = 6.2, kSlope = 0.6, kCrestOff_m = 34, kBack = 0.52;
constexpr double kScannedBelow = 0.3, kScanned_m = 60;  // share of pulses; how far from a crossing

enum class Crossing : std::uint8_t { kBridge, kWideBridge, kFootbridge, kGallery };

// Coordinates from the middle of a crossing.
struct Site {
  Crossing kind;
  double u_m, v_m, clearance_m, half_m;
  std::uint64_t seed;
};

class Overpass final : public World {
 public:
  explicit Overpass(std::uint64_t seed) : seed_(mix(seed ^ 0x0ba55)), plain_(seed_ + 1, 260), rough_(seed_ + 2, 21) {}

  double ground_m(double x, double y) const override {
    const PlanPlace p = to_plan(x, y);
    const Site s = site_at(p);
    const double along = p.u_m - s.u_m, off = p.v_m - s.v_m;
    switch (s.kind) {
      case Crossing::kBridge:
      case Crossing::kWideBridge:
        return plain_m(x, y) + ramp_m(s, along, off);
      case Crossing::kGallery:
        return plain_m(x, y) + slope_m(along, off);
      default:
        return plain_m(x, y);
    }
  }

  double from_below(double x, double y) const override {
    const PlanPlace p = to_plan(x, y);
    const Site s = site_at(p);
    const bool scanned = s.kind == Crossing::kBridge || s.kind == Crossing::kGallery;
    return scanned && std::abs(p.v_m - s.v_m) < kRoadHalf_m && std::abs(p.u_m - s.u_m) < kScanned_m ? kScannedBelow : 0;
  }

  void place(const Box& box, std::vector<Object>& objects) const override {
    Placer placer(*this, box, objects);
    const Box plan = plan_box(box.grown(10));
    for (std::int64_t j = nearest(plan.y0_m, kPitch_v); j <= nearest(plan.y1_m, kPitch_v); ++j)
      for (std::int64_t i = nearest(plan.x0_m, kPitch_u); i <= nearest(plan.x1_m, kPitch_u); ++i)
        fill(site(i, j), placer);
    scatter(seed_ + 5, 7, box, 8, [&](double x, double y, Random& random) {
      const PlanPlace p = to_plan(x, y);
      const Site s = site_at(p);
      const double along = std::abs(p.u_m - s.u_m), off = std::abs(p.v_m - s.v_m);
      if (off < 13 || (along < 20 && s.kind != Crossing::kGallery) || (off > 22 && off < 62 && along < 92)) return;
      if (random.chance(0.3)) placer.add(tree({.x_m = x, .y_m = y}, random, 5, 15, 0.75));
      if (random.chance(0.3)) placer.add(bush({.x_m = x + 2, .y_m = y + 2}, random));
    });
  }

  Survey survey() const override { return {.slanted = true}; }

 private:
  static std::int64_t nearest(double v, double pitch) { return static_cast<std::int64_t>(std::floor(v / pitch + 0.5)); }
  double plain_m(double x, double y) const { return 80 + 2 * plain_.at(x, y) + 0.03 * rough_.at(x, y); }
  double plain_m(const Frame& f) const { return plain_m(f.x_m, f.y_m); }

  Site site_at(PlanPlace p) const { return site(nearest(p.u_m, kPitch_u), nearest(p.v_m, kPitch_v)); }
  Site site(std::int64_t i, std::int64_t j) const {
    Random random(hash_at(seed_ + 3, i, j));
    // In turn, so that a small map has all of them.
    Site s{.kind = static_cast<Crossing>(static_cast<std::uint64_t>(i + 2 * j) & 3),
           .u_m = static_cast<double>(i) * kPitch_u,
           .v_m = static_cast<double>(j) * kPitch_v,
           .clearance_m = 0,
           .half_m = 0,
           .seed = 0};
    s.clearance_m = random.uniform(5.5, 7);
    s.half_m = s.kind == Crossing::kWideBridge ? random.uniform(8, 12) : random.uniform(4.5, 6);
    s.seed = random.bits();
    return s;
  }

  // Earth up to the abutments; its sides slope, its end is upright.
  static double ramp_m(const Site& s, double along, double off) {
    const double away = std::abs(off);
    if (away < kAbutment_m) return 0;
    const double crest = s.clearance_m * clamp_unit((kRampFoot_m - away) / (kRampFoot_m - kCrest_m));
    const double side = std::max(0.0, std::abs(along) - s.half_m - 1) / kBatter;
    return std::max(0.0, crest - side) * clamp_unit((away - kAbutment_m) / kWall_m);
  }

  // A hill cut off beside the road.
  static double slope_m(double along, double off) {
    if (off < kCut_m) return 0;
    const double up = kGallery_m * clamp_unit((off - kCut_m) / kWall_m) + kSlope * std::min(off - kCut_m, kCrestOff_m);
    const double hill = up - kBack * std::max(0.0, off - kCut_m - kCrestOff_m);
    return std::max(0.0, hill) * fade(clamp_unit((95 - std::abs(along)) / 40));
  }

  void fill(const Site& s, Placer& placer) const {
    Random random(s.seed);
    switch (s.kind) {
      case Crossing::kBridge:
      case Crossing::kWideBridge:
        bridge(s, random, placer);
        break;
      case Crossing::kFootbridge:
        footbridge(s, placer);
        break;
      case Crossing::kGallery:
        gallery(s, placer);
        break;
    }
    for (double u = -kPitch_u / 2; u < kPitch_u / 2; u += random.uniform(12, 40)) {
      const double lane = random.chance(0.5) ? 2.4 : -2.4;
      placer.add(random.chance(0.15) ? lorry(plan_frame(s.u_m + u, s.v_m + lane), random)
                                     : car(plan_frame(s.u_m + u, s.v_m + lane), random));
    }
    for (int k = 0; k < 8; ++k) {
      const double side = k % 2 == 0 ? -1 : 1, row = k / 4 == 0 ? -1 : 1;
      const double u = side * (k % 4 < 2 ? 48.0 : 76.0);
      if (s.kind != Crossing::kGallery || row < 0) house(s, u, row * 42, random, placer);
    }
  }

  // Between two places of a site at two heights above the plain.
  Object deck(const Frame& middle, double half_s, double half_t, double start_m, double end_m) const {
    Object o{.form = Form::kDeck, .label = SceneClass::kBridgeDeck, .frame = middle};
    o.half_s_m = half_s;
    o.half_t_m = half_t;
    for (std::size_t k = 0; k < 4; ++k) {
      const Frame corner = middle.moved(k % 2 == 0 ? -half_s : half_s, k < 2 ? -half_t : half_t);
      o.corners_m[k] = plain_m(corner) + (k % 2 == 0 ? start_m : end_m);
    }
    return o;
  }

  void bridge(const Site& s, Random& random, Placer& placer) const {
    const Frame middle = plan_frame(s.u_m, s.v_m).moved(0, 0, 0, 1);
    Object o = deck(middle, kAbutment_m + 0.3, s.half_m, s.clearance_m, s.clearance_m);
    o.rim_width_m = 1.2;
    o.rim_height_m = 0.12;
    placer.add(o);
    for (int k = 0; k < 5; ++k) {
      const double lane = random.chance(0.5) ? 2.0 : -2.0, run = random.uniform(-75, 75);
      Object vehicle = car(middle.moved(run, lane), random);
      if (std::abs(run) < kAbutment_m - 3) {  // on the deck
        vehicle.follows_ground = false;
        if (const auto z = o.top(vehicle.frame.x_m, vehicle.frame.y_m)) placer.add_at(vehicle, *z);
      } else if (std::abs(run) > kAbutment_m + 3) {
        placer.add(vehicle);
      }
    }
  }

  void footbridge(const Site& s, Placer& placer) const {
    const Frame middle = plan_frame(s.u_m, s.v_m).moved(0, 0, 0, 1);
    const double up = s.clearance_m - 0.5;
    placer.add(deck(middle, kFootSpan_m, kFootHalf_m, up, up));
    const double ramp = kFootSpan_m + kFootRamp_m / 2;
    placer.add(deck(middle.moved(ramp, 0), kFootRamp_m / 2, kFootHalf_m, up, 0));
    placer.add(deck(middle.moved(-ramp, 0), kFootRamp_m / 2, kFootHalf_m, 0, up));
  }

  void gallery(const Site& s, Placer& placer) const {
    const double front = -kRoadHalf_m - 0.6, back = kCut_m + kWall_m;
    const Frame middle = plan_frame(s.u_m, s.v_m + (front + back) / 2);
    Object roof = deck(middle, kGalleryHalf_m, (back - front) / 2, 0, 0);
    for (std::size_t k = 0; k < 4; ++k) roof.corners_m[k] += k < 2 ? kGalleryFront_m : kGallery_m;
    placer.add(roof);
    for (double u = -kGalleryHalf_m + 0.5; u < kGalleryHalf_m; u += 5) {
      Object pillar{.label = SceneClass::kBuilding, .frame = plan_frame(s.u_m + u, s.v_m + front + 0.4)};
      pillar.half_s_m = pillar.half_t_m = 0.25;
      pillar.height_m = kGalleryFront_m - kPillarGap_m;
      placer.add(pillar);
    }
  }

  void house(const Site& s, double u, double v, Random& random, Placer& placer) const {
    Object o{.label = SceneClass::kBuilding, .frame = plan_frame(s.u_m + u, s.v_m + v)};
    o.half_s_m = random.uniform(6, 10);
    o.half_t_m = random.uniform(5, 8);
    o.height_m = random.uniform(5, 12);
    if (random.chance(0.6)) {
      o.form = random.chance(0.5) ? Form::kGable : Form::kHip;
      o.eaves_m = 0.6 * o.height_m;
    }
    if (random.chance(0.85)) placer.add(o);
  }

  static constexpr double kPillarGap_m = 0.8;  // the roof's own thickness
  std::uint64_t seed_;
  Noise plain_, rough_;
};

}  // namespace

std::unique_ptr<World> make_overpass(std::uint64_t seed) { return std::make_unique<Overpass>(seed); }

}  // namespace btms
