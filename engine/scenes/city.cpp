#include "engine/scenes/city.h"

#include <algorithm>
#include <cmath>

namespace btms {
namespace {

// The grid is turned by the exact angle of the 5-12-13 triangle, so that nothing lies along the axes of the map.
constexpr double kCos = 12.0 / 13, kSin = 5.0 / 13;
constexpr double kPitch_m = 96, kJitter_m = 14;
constexpr double kBend_m = 18, kBendLength_m = 520;

// Steps up towards the middle of a block, with a ramp from the west. d is the distance from the block's edge.
double terraces_m(BlockKind kind, double d_m, double from_west_m, double off_axis_m) {
  if (kind != BlockKind::kPark && kind != BlockKind::kTower) return 0;
  const bool park = kind == BlockKind::kPark;
  const double top = park ? 2.4 : 1.2;
  if (off_axis_m < 2.5 && from_west_m < 30) return std::clamp((from_west_m - 2) * 0.09, 0.0, top);
  if (!park) return d_m > 6 ? top : 0;
  return 0.8 * ((d_m > 9) + (d_m > 18) + (d_m > 26));
}

double cut_m(const Street& s, double distance_m) {
  if (!s.cutting || distance_m >= kCuttingHalf_m) return 0;
  return kCuttingDepth_m * clamp_unit((kCuttingHalf_m - distance_m) / (kCuttingHalf_m - kCuttingBottom_m));
}

// Everything of a plot: half the streets and the crowns that hang over them too.
Box reach_of(const Plot& p) {
  const double out = kPavement_m + 8;
  return Object{.frame = p.frame, .half_s_m = p.half_s_m + out, .half_t_m = p.half_t_m + out}.bounds();
}

}  // namespace

City::City(std::uint64_t seed)
    : seed_(mix(seed ^ 0xc17f)),
      hill_(seed_ + 1, 420),
      slope_(seed_ + 2, 130),
      bend_u_(seed_ + 3, kBendLength_m),
      bend_v_(seed_ + 4, kBendLength_m) {}

double City::relief_m(double x_m, double y_m) const { return 40 + 5 * hill_.at(x_m, y_m) + 0.9 * slope_.at(x_m, y_m); }

City::Bent City::bend(double x_m, double y_m) const {
  const double a = kCos * x_m + kSin * y_m, b = kCos * y_m - kSin * x_m;
  return {a + kBend_m * bend_u_.at(b), b + kBend_m * bend_v_.at(a)};
}

Frame City::frame_at(Bent p) const {
  double a = p.u_m, b = p.v_m;
  for (int k = 0; k < 10; ++k) {  // each round takes the error down by the square of the steepest bend, 0.13
    a = p.u_m - kBend_m * bend_u_.at(b);
    b = p.v_m - kBend_m * bend_v_.at(a);
  }
  const double f = kBend_m * bend_u_.slope(b), g = kBend_m * bend_v_.slope(a);
  return {kCos * a - kSin * b, kSin * a + kCos * b, kCos - f * kSin, kSin + f * kCos, g * kCos - kSin, g * kSin + kCos};
}

Street City::across(std::int64_t i) const {
  const std::uint64_t h = hash_at(seed_ + 5, i);
  const bool cutting = (i % 5 + 5) % 5 == 2, avenue = i % 4 == 0;
  return {static_cast<double>(i) * kPitch_m + kJitter_m * signed_unit(h),
          cutting  ? kCuttingHalf_m
          : avenue ? 7.5
                   : 3.5 + unit(mix(h)),
          cutting};
}

Street City::along(std::int64_t j) const {
  const std::uint64_t h = hash_at(seed_ + 6, j);
  return {static_cast<double>(j) * kPitch_m + kJitter_m * signed_unit(h), j % 3 == 0 ? 7.5 : 3.5 + unit(mix(h)), false};
}

std::int64_t City::column(double u_m) const {
  const auto i = static_cast<std::int64_t>(std::floor(u_m / kPitch_m));
  return u_m < across(i).centre_m ? i - 1 : u_m >= across(i + 1).centre_m ? i + 1 : i;
}

std::int64_t City::row(double v_m) const {
  const auto j = static_cast<std::int64_t>(std::floor(v_m / kPitch_m));
  return v_m < along(j).centre_m ? j - 1 : v_m >= along(j + 1).centre_m ? j + 1 : j;
}

// A fixed mix of kinds over any sixteen neighbours, so that a small map is a city too.
BlockKind City::kind(std::int64_t i, std::int64_t j) const {
  using enum BlockKind;
  constexpr BlockKind kMix[16] = {kCourtyard, kHouses, kHalls, kSlabs, kCourtyard, kHouses, kTower,  kCourtyard,
                                  kHalls,     kHouses, kSlabs, kPark,  kCourtyard, kHalls,  kHouses, kSlabs};
  return kMix[static_cast<std::uint64_t>(7 * i + 3 * j + static_cast<std::int64_t>(seed_ >> 60)) & 15];
}

double City::ground_m(double x_m, double y_m) const {
  const double relief = relief_m(x_m, y_m);
  const Bent p = bend(x_m, y_m);
  const std::int64_t i = column(p.u_m), j = row(p.v_m);
  const Street west = across(i), east = across(i + 1), south = along(j), north = along(j + 1);
  const double from_west = p.u_m - west.centre_m, from_east = east.centre_m - p.u_m;
  const double from_south = p.v_m - south.centre_m, from_north = north.centre_m - p.v_m;
  if (const double cut = cut_m(west, from_west) + cut_m(east, from_east); cut > 0) return relief - cut;

  const double w = from_west - west.half_m, e = from_east - east.half_m;
  const double s = from_south - south.half_m, n = from_north - north.half_m;
  const double from_kerb = std::min(std::min(w, e), std::min(s, n));
  if (from_kerb < 0) return relief;
  return relief + kKerb_m + terraces_m(kind(i, j), from_kerb - kPavement_m, w - kPavement_m, std::abs(s - n) / 2);
}

// Roads in cuttings are a net of their own, below the bridges of this one.
std::optional<double> City::street_m(double x_m, double y_m) const {
  const Bent p = bend(x_m, y_m);
  const std::int64_t i = column(p.u_m), j = row(p.v_m);
  const auto within = [](const Street& s, double v) { return !s.cutting && std::abs(v - s.centre_m) < s.half_m; };
  const bool along_one = within(along(j), p.v_m) || within(along(j + 1), p.v_m);
  const bool in_cutting =
      cut_m(across(i), p.u_m - across(i).centre_m) + cut_m(across(i + 1), across(i + 1).centre_m - p.u_m) > 0;
  if (!along_one && (in_cutting || !(within(across(i), p.u_m) || within(across(i + 1), p.u_m)))) return std::nullopt;
  return relief_m(x_m, y_m);
}

Plot City::plot(std::int64_t i, std::int64_t j) const {
  Plot p{.kind = kind(i, j), .west = across(i), .east = across(i + 1), .south = along(j), .north = along(j + 1)};
  const double u0 = p.west.centre_m + p.west.half_m + kPavement_m, u1 = p.east.centre_m - p.east.half_m - kPavement_m;
  const double v0 = p.south.centre_m + p.south.half_m + kPavement_m;
  const double v1 = p.north.centre_m - p.north.half_m - kPavement_m;
  p.frame = frame_at({(u0 + u1) / 2, (v0 + v1) / 2});
  p.half_s_m = (u1 - u0) / 2;
  p.half_t_m = (v1 - v0) / 2;
  p.seed = hash_at(seed_ + 7, i, j);
  return p;
}

// The street crosses at the height the terrain would have without the cutting, so both ends join without a step.
void City::bridge(std::int64_t i, std::int64_t j, Placer& placer) const {
  const Street below = across(i), street = along(j);
  if (!below.cutting) return;
  const Frame frame = frame_at({below.centre_m, street.centre_m});
  Object deck{.form = Form::kDeck, .label = SceneClass::kBridgeDeck, .frame = frame};
  deck.half_s_m = kCuttingHalf_m + 0.5;
  deck.half_t_m = street.half_m + kPavement_m;
  deck.rim_width_m = kPavement_m;
  deck.rim_height_m = kKerb_m;
  for (std::size_t k = 0; k < 4; ++k) {
    const Frame corner =
        frame.moved(k % 2 == 0 ? -deck.half_s_m : deck.half_s_m, k < 2 ? -deck.half_t_m : deck.half_t_m);
    deck.corners_m[k] = relief_m(corner.x_m, corner.y_m);
  }
  placer.add(deck);
  // Cars on the road below.
  Random random(hash_at(seed_ + 8, i, j));
  for (int k = 0; k < 4; ++k) {
    const double side = random.chance(0.5) ? 2 : -2, place = random.uniform(-45, 45);
    placer.add({.form = Form::kCar,
                .label = SceneClass::kVehicle,
                .follows_ground = true,
                .frame = frame.moved(side, place, 0, 1),
                .half_s_m = 2.2,
                .half_t_m = 0.9,
                .height_m = 1.5,
                .eaves_m = 0.95});
  }
}

void City::place(const Box& box, std::vector<Object>& objects) const {
  const double cx = (box.x0_m + box.x1_m) / 2, cy = (box.y0_m + box.y1_m) / 2;
  const double dx = box.x1_m - cx, dy = box.y1_m - cy;
  // The bending stretches by 1.2 at most; a crown reaches this far out of its block.
  const double reach = 1.2 * std::sqrt(dx * dx + dy * dy) + 10;
  const Bent middle = bend(cx, cy);
  Placer placer(*this, box, objects);
  for (std::int64_t j = row(middle.v_m - reach); j <= row(middle.v_m + reach) + 1; ++j)
    for (std::int64_t i = column(middle.u_m - reach); i <= column(middle.u_m + reach) + 1; ++i) {
      if (const Plot p = plot(i, j); placer.wants(reach_of(p))) fill_plot(p, placer);
      bridge(i, j, placer);
    }
}

std::unique_ptr<World> make_city(std::uint64_t seed) { return std::make_unique<City>(seed); }

}  // namespace btms
