#include "engine/terrain/level_complete.h"

#include <algorithm>
#include <cmath>

#include "engine/lattice/lanes.h"
#include "engine/terrain/kernel.h"

namespace btms {
namespace {

static_assert(kTriangles == kLanes);
constexpr double kMaxSpread_mm = 1 << 14;
constexpr double kCoarser = 1 << 12;             // kernel values in squared spreads have 12 bits
constexpr std::int64_t kExactRise_mm = 1 << 26;  // times a kernel value, and leaning: below 2^51

void place_at_centroid(LevelNode& node, std::uint8_t t, double z, const PriorPlane& prior, const LevelRules& rules) {
  node.mean_x_mm = rules.centroid(t).rounded_x_mm;
  node.mean_y_mm = rules.centroid(t).rounded_y_mm;
  node.mean_z_mm = height_mm(z);
  node.slope_x = stored_slope(prior.slope_x);
  node.slope_y = stored_slope(prior.slope_y);
}

double height_at_centroid(std::uint8_t t, const PriorPlane& prior, const LevelRules& rules) {
  return prior.at(rules.centroid(t).x_mm, rules.centroid(t).y_mm);
}

// The four nodes of a square as receivers.
struct Receivers {
  Lanes x3{}, y3{}, datum{};
};

// Finds the neighbours within the radius of any lane; nobody can foretell which, and what follows has no branches.
BTMS_INLINE std::size_t find_within(std::span<const LevelNeighbourhood::Neighbour> nodes, const Receivers& to,
                                    const Lanes& radius9, LevelTerms* terms) {
  std::size_t n = 0;
  for (const LevelNeighbourhood::Neighbour& from : nodes) {
    const Lanes dx3 = from.x3 - to.x3, dy3 = from.y3 - to.y3;
    terms[n].from = &from;
    n += any_lane(dx3 * dx3 + dy3 * dy3 < radius9);
  }
  return n;
}

// Fills in what they say. Returns the sum of k.
BTMS_INLINE LongLanes weigh(std::span<LevelTerms> terms, const Receivers& to, const Lanes& radius, const Lanes& radius9,
                            double tilt) {
  LongLanes sum{};
  for (LevelTerms& term : terms) {
    const LevelNeighbourhood::Neighbour& from = *term.from;
    const Lanes dx3 = from.x3 - to.x3, dy3 = from.y3 - to.y3, d9 = dx3 * dx3 + dy3 * dy3;
    const Lanes kernel = floor_lanes(kernel_polynomial(sqrt_lanes(d9) / 3.0 / radius) * kKernelUnit + 0.5);
    const Lanes k = d9 < radius9 ? floor_lanes(kernel * from.weight * (1 / kWeightUnit)) : Lanes{};
    // Its height, and a share of what its plane says of this place.
    const Lanes lean = -(from.slope_x / kSlopeUnit * dx3 + from.slope_y / kSlopeUnit * dy3) / 3.0;
    store_lanes(term.k, k);
    store_lanes(term.z, from.z_mm - to.datum + floor_lanes(tilt * lean + 0.5));
    sum += small_integers(k);
  }
  return sum;
}

// Of k z. Heights from the datum are at most rise_mm, before leaning.
BTMS_INLINE LongLanes weighted_sum(std::span<const LevelTerms> terms, std::int64_t rise_mm) {
  LongLanes sum{};
  for (const LevelTerms& t : terms) {
    const Lanes k = load_lanes(t.k), z = load_lanes(t.z);
    sum += rise_mm < kExactRise_mm ? small_integers(k * z) : small_integers(k) * small_integers(z);
  }
  return sum;
}

// Of the heights about their mean.
BTMS_INLINE Lanes spread(std::span<const LevelTerms> terms, const Lanes& mean) {
  const Lanes middle = floor_lanes(mean + 0.5);
  LongLanes squares{}, sum{};
  for (const LevelTerms& term : terms) {
    const Lanes e = clamp_lanes(load_lanes(term.z) - middle, kMaxSpread_mm);
    const Lanes k = floor_lanes((load_lanes(term.k) + kCoarser / 2) * (1 / kCoarser));
    squares += small_integers(k * e * e);
    sum += small_integers(k);
  }
  return sum > 0 ? sqrt_lanes(mostly_small_lanes(squares) / mostly_small_lanes(sum)) : Lanes{};
}

}  // namespace

void LevelNeighbourhood::clear() {
  size_ = 0;
  lowest_mm_ = INT32_MAX;
  highest_mm_ = INT32_MIN;
}

void LevelNeighbourhood::add(const LevelNode* cell, std::int32_t x_mm, std::int32_t y_mm) {
  if (nodes_.size() < size_ + kTriangles) nodes_.resize(2 * size_ + kTriangles);
  for (int t = 0; t < kTriangles; ++t) {
    const LevelNode& node = cell[t];
    if (!node.has_plane()) continue;
    nodes_[size_++] = {3.0 * (x_mm + node.mean_x_mm),       3.0 * (y_mm + node.mean_y_mm),
                       static_cast<double>(node.mean_z_mm), static_cast<double>(node.slope_x),
                       static_cast<double>(node.slope_y),   static_cast<double>(node.weight)};
    lowest_mm_ = std::min(lowest_mm_, node.mean_z_mm);
    highest_mm_ = std::max(highest_mm_, node.mean_z_mm);
  }
}

void take_prior(LevelNode& node, std::uint8_t t, const PriorPlane& prior, const LevelRules& rules) {
  place_at_centroid(node, t, height_at_centroid(t, prior, rules), prior, rules);
  node.weight = saturate_u16(rules.p().least_weight * kWeightUnit);
  node.sd_mm = saturate_u16(prior.sd_mm);
  node.source = prior.source;
}

BTMS_WIDE void complete_level_square(LevelNode* nodes, const std::array<bool, kTriangles>& wanted,
                                     std::int32_t centre_x_mm, std::int32_t centre_y_mm, const LevelNeighbourhood& near,
                                     const SquarePriors& priors, const LevelRules& rules,
                                     std::vector<LevelTerms>& terms) {
  const LevelParameters& q = rules.p();
  Receivers to;
  std::array<double, kTriangles> p{};
  LongLanes wants{};
  double lowest_datum = 0, highest_datum = 0;
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    if (!rules.first()) p[t] = height_at_centroid(t, priors[t], rules);
    to.x3[t] = static_cast<double>(3 * std::int64_t{centre_x_mm} + rules.centroid(t).x3);
    to.y3[t] = static_cast<double>(3 * std::int64_t{centre_y_mm} + rules.centroid(t).y3);
    to.datum[t] = round_half_up(p[t]);
    lowest_datum = t == 0 ? to.datum[t] : std::min(lowest_datum, to.datum[t]);
    highest_datum = t == 0 ? to.datum[t] : std::max(highest_datum, to.datum[t]);
    wants[t] = wanted[t] ? -1 : 0;
  }
  // One more: the place after the last found is written too.
  if (terms.size() <= near.nodes().size()) terms.resize(near.nodes().size() + 1);

  // On the first level the radius may double twice.
  const double enough = rules.first() ? 1e-3 * kKernelUnit : 0;
  Lanes radius = Lanes{} + round_half_up(q.level_kernel_radius * rules.r_mm());
  LongLanes sum{};
  std::span<LevelTerms> used;
  for (int doublings = rules.first() ? 2 : 0;; --doublings) {
    const Lanes radius9 = 9.0 * radius * radius;
    used = {terms.data(), find_within(near.nodes(), to, radius9, terms.data())};
    sum = weigh(used, to, radius, radius9, rules.first() ? q.first_tilt : q.tilt);
    const LongLanes few = wants & (mostly_small_lanes(sum) <= enough);
    if (doublings == 0 || !any_lane(few)) break;
    radius = few ? 2.0 * radius : radius;
  }
  const LongLanes weighted = weighted_sum(used, std::max(near.highest_mm() - static_cast<std::int64_t>(lowest_datum),
                                                         static_cast<std::int64_t>(highest_datum) - near.lowest_mm()));
  const Lanes s = mostly_small_lanes(sum), z = mostly_small_lanes(weighted);
  const Lanes shrunk = z / (s + (rules.first() ? 0.0 : q.shrink * kKernelUnit)), sd = spread(used, z / s);
  const Lanes support = s / kKernelUnit;
  const Lanes weight = (q.completed_weight * support / (support + 1.0) + q.least_weight) * kWeightUnit;
  const PriorPlane none;
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    if (!wanted[t]) continue;
    LevelNode& node = nodes[t];
    if (sum[t] == 0) {
      if (rules.first())
        node.level_class = LevelClass::kOutside;
      else
        take_prior(node, t, priors[t], rules);
      continue;
    }
    place_at_centroid(node, t, p[t] + (to.datum[t] - p[t]) + shrunk[t], rules.first() ? none : priors[t], rules);
    node.source = 0;
    node.weight = saturate_u16(weight[t]);
    node.sd_mm = saturate_u16(sd[t]);
  }
}

}  // namespace btms
