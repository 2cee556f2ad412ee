#include "engine/scenes/slanted.h"

#include <algorithm>
#include <cmath>

#include "engine/scenes/bisection.h"

namespace btms {
namespace {

constexpr double kSteepest = 0.36, kStrip_m = 180;
constexpr double kStep_m = 0.25;                     // up, along a pulse
constexpr double kCliff_m = 15, kCliffStep_m = 0.4;  // the highest cliff that counts; along the ground
constexpr double kFlat = 0.02;                       // below this there is no shadow worth a name
constexpr int kHalvings = 8;

// The highest the top can be.
double highest(const Object& o, const World& world) {
  if (o.form == Form::kDeck) return *std::max_element(o.corners_m.begin(), o.corners_m.end()) + o.rim_height_m;
  const double base = o.follows_ground ? world.ground_m(o.frame.x_m, o.frame.y_m) + 1 : o.base_m;
  return base + o.height_m + o.rim_height_m;
}

// Whether a place in space is in an object, where that stands clear of the ground.
bool inside(const World& world, const Object& o, double x, double y, double z) {
  if (!o.top(x, y)) return false;
  const double ground = world.ground_m(x, y), top = *absolute_top(o, x, y, ground);
  return z <= top && z >= ground && top > ground + kClear_m && (o.form != Form::kDeck || z >= top - kDeckThickness_m);
}

}  // namespace

double slant(double x_m) {
  const double p = x_m / kStrip_m;
  return kSteepest * (4 * std::abs(p - std::floor(p) - 0.5) - 1);
}

bool is_solid(const Object& o) { return o.opacity == 1 && o.scatter_m == 0; }

std::optional<double> absolute_top(const Object& o, double x_m, double y_m, double ground_m) {
  const std::optional<double> top = o.top(x_m, y_m);
  if (!top || o.form == Form::kDeck) return top;
  return *top + (o.follows_ground ? ground_m : o.base_m);
}

std::optional<Stop> stopped(const World& world, std::span<const Object> solids, std::span<const std::uint32_t> near,
                            const Aim& aim) {
  const double x_m = aim.x_m, y_m = aim.y_m, ground_m = aim.ground_m, slant = aim.slant;
  std::optional<Stop> stop;
  for (const std::uint32_t i : near) {
    const Object& o = solids[i];
    const Box b = o.bounds();
    if (y_m < b.y0_m || y_m > b.y1_m || (o.form == Form::kDeck && !aim.decks)) continue;
    double low = 0, high = std::min(highest(o, world) - ground_m, kSlantReach_m / kSteepest);
    if (slant > kFlat) {
      low = std::max(low, (b.x0_m - x_m) / slant);
      high = std::min(high, (b.x1_m - x_m) / slant);
    } else if (slant < -kFlat) {
      low = std::max(low, (b.x1_m - x_m) / slant);
      high = std::min(high, (b.x0_m - x_m) / slant);
    } else if (x_m < b.x0_m - kFlat * high || x_m > b.x1_m + kFlat * high) {
      continue;
    }
    const auto in = [&](double up) { return inside(world, o, x_m + slant * up, y_m, ground_m + up); };
    for (double up = high; up >= low && (!stop || up > stop->up_m); up = up > low ? std::max(low, up - kStep_m) : -1)
      if (in(up)) {
        stop = {up == high ? up : entry<kHalvings>(up + kStep_m, up, in), &o};
        break;
      }
  }
  if (std::abs(slant) < kFlat) return stop;
  const double step = kCliffStep_m / std::abs(slant);
  const auto buried = [&](double up) { return up > 0 && world.ground_m(x_m + slant * up, y_m) > ground_m + up + 0.02; };
  for (double up = std::floor(kCliff_m / step) * step; up > 0 && (!stop || up > stop->up_m); up -= step)
    if (buried(up)) return Stop{entry<kHalvings>(up + step, up, buried), nullptr};
  return stop;
}

}  // namespace btms
