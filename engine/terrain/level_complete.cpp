#include "engine/terrain/level_complete.h"

#include <algorithm>
#include <cmath>

#include "engine/lattice/lattice.h"
#include "engine/terrain/kernel.h"

namespace btms {
namespace {

constexpr double kMaxSpread_mm = 1 << 14;
constexpr double kCoarser = 1 << 12;             // kernel values in squared spreads have 12 bits
constexpr std::int32_t kNowhere_mm = 1 << 30;    // beyond all reach, and three times that is exact
constexpr std::int64_t kExactRise_mm = 1 << 26;  // times a kernel value, and leaning: below 2^51

// Of k z. Heights from the datum are at most rise_mm, before leaning.
BTMS_INLINE std::int64_t weighted_sum(std::span<const LevelTerms> terms, std::int64_t rise_mm) {
  LongLanes sum{};
  for (const LevelTerms& t : terms) {
    const Lanes k = load(t.k), z = load(t.z);
    sum += rise_mm < kExactRise_mm ? to_integers(k * z) : to_integers(k) * to_integers(z);
  }
  return total(sum);
}

void place_at_centroid(LevelNode& node, std::uint8_t t, double z, const PriorPlane& prior, const LevelRules& rules) {
  node.mean_x_mm = static_cast<std::int16_t>(floor_div(centroid_x3(t, rules.r_mm()) + 1, 3));
  node.mean_y_mm = static_cast<std::int16_t>(floor_div(centroid_y3(t, rules.r_mm()) + 1, 3));
  node.mean_z_mm = height_mm(z);
  node.slope_x = stored_slope(prior.slope_x);
  node.slope_y = stored_slope(prior.slope_y);
}

}  // namespace

void LevelNeighbourhood::clear() {
  squares_.clear();
  lowest_mm_ = INT32_MAX;
  highest_mm_ = INT32_MIN;
}

void LevelNeighbourhood::add(const LevelNode* cell, std::int32_t x_mm, std::int32_t y_mm) {
  Square& s = squares_.emplace_back();
  for (std::size_t t = 0; t < kLanes; ++t) {
    const LevelNode& node = cell[t];
    s.x_mm[t] = node.has_plane() ? x_mm + node.mean_x_mm : kNowhere_mm;
    s.y_mm[t] = y_mm + node.mean_y_mm;
    s.z_mm[t] = node.mean_z_mm;
    s.slope_x[t] = node.slope_x;
    s.slope_y[t] = node.slope_y;
    s.weight[t] = node.weight;
    if (!node.has_plane()) continue;
    lowest_mm_ = std::min(lowest_mm_, node.mean_z_mm);
    highest_mm_ = std::max(highest_mm_, node.mean_z_mm);
  }
}

void take_prior(LevelNode& node, std::uint8_t t, const PriorPlane& prior, const LevelRules& rules) {
  place_at_centroid(node, t,
                    prior.at(static_cast<double>(centroid_x3(t, rules.r_mm())) / 3,
                             static_cast<double>(centroid_y3(t, rules.r_mm())) / 3),
                    prior, rules);
  node.weight = saturate_u16(rules.p().least_weight * kWeightUnit);
  node.sd_mm = saturate_u16(prior.sd_mm);
  node.source = prior.source;
}

BTMS_WIDE void complete_level_node(LevelNode& node, std::uint8_t t, std::int32_t centre_x_mm, std::int32_t centre_y_mm,
                                   const LevelNeighbourhood& near, const PriorPlane& given, const LevelRules& rules,
                                   std::vector<LevelTerms>& terms) {
  const LevelParameters& q = rules.p();
  const PriorPlane none, &prior = rules.first() ? none : given;
  const std::int64_t x3 = 3 * std::int64_t{centre_x_mm} + centroid_x3(t, rules.r_mm());
  const std::int64_t y3 = 3 * std::int64_t{centre_y_mm} + centroid_y3(t, rules.r_mm());
  const double p = prior.at(static_cast<double>(centroid_x3(t, rules.r_mm())) / 3,
                            static_cast<double>(centroid_y3(t, rules.r_mm())) / 3);
  const auto datum = static_cast<std::int64_t>(round_half_up(p));
  const double tilt = rules.first() ? q.first_tilt : q.tilt;

  const std::span<const LevelNeighbourhood::Square> squares = near.squares();
  if (terms.size() < squares.size()) terms.resize(squares.size());
  const Lanes to_x = Lanes{} + static_cast<double>(x3), to_y = Lanes{} + static_cast<double>(y3);
  std::size_t n = 0;  // squares with a node in reach
  std::int64_t sum = 0;
  for (int doubling = 0; doubling < (rules.first() ? 3 : 1); ++doubling) {
    const double radius = round_half_up(q.level_kernel_radius * rules.r_mm()) * (1 << doubling);
    const double radius9 = 9 * radius * radius;
    // Looked for first: nobody can foretell which, and what follows has no branches.
    n = 0;
    for (std::size_t i = 0; i < squares.size(); ++i) {
      const Lanes dx3 = 3.0 * to_doubles(squares[i].x_mm) - to_x, dy3 = 3.0 * to_doubles(squares[i].y_mm) - to_y;
      terms[n].square = &squares[i];
      n += any(dx3 * dx3 + dy3 * dy3 < radius9);
    }
    LongLanes k_sum{};
    for (std::size_t i = 0; i < n; ++i) {
      const LevelNeighbourhood::Square& s = *terms[i].square;
      const Lanes dx3 = 3.0 * to_doubles(s.x_mm) - to_x, dy3 = 3.0 * to_doubles(s.y_mm) - to_y;
      const Lanes d9 = dx3 * dx3 + dy3 * dy3;
      const Lanes kernel = floor_of(kernel_within(root_of(d9) / 3.0 / radius) * kKernelUnit + 0.5);
      const Lanes k = d9 < radius9 ? floor_of(kernel * to_doubles(s.weight) * (1 / kWeightUnit)) : Lanes{};
      // Its height, and a share of what its plane says of this place.
      const Lanes lean =
          -(to_doubles(s.slope_x) * (1 / kSlopeUnit) * dx3 + to_doubles(s.slope_y) * (1 / kSlopeUnit) * dy3) / 3.0;
      store(k, terms[i].k);
      store(to_doubles(s.z_mm) - static_cast<double>(datum) + floor_of(tilt * lean + 0.5), terms[i].z);
      k_sum += to_integers(k);
    }
    sum = total(k_sum);
    if (static_cast<double>(sum) > (rules.first() ? 1e-3 * kKernelUnit : 0.0)) break;
  }
  if (sum == 0) {
    if (rules.first()) {
      node.level_class = LevelClass::kOutside;
      return;
    }
    const std::uint16_t count = node.count;
    take_prior(node, t, given, rules);
    node.count = count;
    return;
  }
  const std::span<const LevelTerms> used(terms.data(), n);
  const std::int64_t weighted = weighted_sum(used, std::max(near.highest_mm() - datum, datum - near.lowest_mm()));
  const double s = static_cast<double>(sum);
  const double mean = static_cast<double>(weighted) / s;
  const double shrunk = static_cast<double>(weighted) / (s + (rules.first() ? 0 : q.shrink * kKernelUnit));
  LongLanes square_sum{}, coarse_sum{};
  const double middle = round_half_up(mean);
  for (const LevelTerms& term : used) {
    const Lanes e = limited(load(term.z) - middle, kMaxSpread_mm);
    const Lanes k = floor_of((load(term.k) + kCoarser / 2) * (1 / kCoarser));
    square_sum += to_integers(k * e * e);
    coarse_sum += to_integers(k);
  }
  const std::int64_t square = total(square_sum), coarse = total(coarse_sum);
  place_at_centroid(node, t, p + (static_cast<double>(datum) - p) + shrunk, prior, rules);
  node.source = 0;
  const double support = s / kKernelUnit;
  node.weight = saturate_u16((q.completed_weight * support / (support + 1) + q.least_weight) * kWeightUnit);
  node.sd_mm = saturate_u16(coarse > 0 ? std::sqrt(static_cast<double>(square) / static_cast<double>(coarse)) : 0);
}

}  // namespace btms
