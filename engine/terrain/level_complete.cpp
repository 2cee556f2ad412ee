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

BTMS_INLINE void place_at_centroid(LevelNode& node, std::uint8_t t, double z, const PriorPlane& prior,
                                   const LevelRules& rules) {
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

// Sums of k and of k z.
struct TermSums {
  LongLanes k{}, kz{};
};

// Works out what neighbours say, and sums it. Heights from the datum are at most rise_mm, before leaning.
BTMS_INLINE TermSums weigh(const LevelNeighbourhood& near, std::span<const std::uint32_t> found, const Receivers& to,
                           const Lanes& radius, double tilt, std::int64_t rise_mm, LevelTerms* terms) {
  const Lanes radius3 = 3.0 * radius, radius9 = radius3 * radius3;
  TermSums sum;
  for (const std::uint32_t i : found) {
    const LevelNeighbourhood::Neighbour& from = near.node(i);
    const Lanes dx3 = from.x3 - to.x3, dy3 = from.y3 - to.y3, d9 = dx3 * dx3 + dy3 * dy3;
    const Lanes kernel = floor_lanes(kernel_polynomial(sqrt_lanes(d9) / radius3) * kKernelUnit + 0.5);
    const Lanes k = d9 < radius9 ? floor_lanes(kernel * from.weight * (1 / kWeightUnit)) : Lanes{};
    // Its height, and a share of what its plane says of this place.
    const Lanes lean = -(from.slope_x / kSlopeUnit * dx3 + from.slope_y / kSlopeUnit * dy3) / 3.0;
    const Lanes z = from.z_mm - to.datum + floor_lanes(tilt * lean + 0.5);
    store_lanes(terms->k, k);
    store_lanes(terms->z, z);
    ++terms;
    sum.k += small_integers(k);
    sum.kz += rise_mm < kExactRise_mm ? small_integers(k * z) : small_integers(k) * small_integers(z);
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
  return sum > 0 ? sqrt_lanes(to_lanes(squares) / to_lanes(sum)) : Lanes{};
}

}  // namespace

void LevelNeighbourhood::clear() {
  size_ = chosen_ = 0;
  lowest_mm_ = INT32_MAX;
  highest_mm_ = INT32_MIN;
}

LevelNeighbourhood::Square LevelNeighbourhood::add(const LevelNode* cell, std::int32_t x_mm, std::int32_t y_mm) {
  if (nodes_.size() < size_ + kTriangles) {
    nodes_.resize(2 * size_ + kTriangles);
    x3_.resize(nodes_.size() + kTriangles);  // choose() reads four
    y3_.resize(nodes_.size() + kTriangles);
  }
  const std::size_t first = size_;
  for (int t = 0; t < kTriangles; ++t) {
    const LevelNode& node = cell[t];
    if (!node.has_plane()) continue;
    const Neighbour n{3.0 * (x_mm + node.mean_x_mm),       3.0 * (y_mm + node.mean_y_mm),
                      static_cast<double>(node.mean_z_mm), static_cast<double>(node.slope_x),
                      static_cast<double>(node.slope_y),   static_cast<double>(node.weight)};
    nodes_[size_] = n;
    x3_[size_] = static_cast<float>(n.x3);
    y3_[size_++] = static_cast<float>(n.y3);
    lowest_mm_ = std::min(lowest_mm_, node.mean_z_mm);
    highest_mm_ = std::max(highest_mm_, node.mean_z_mm);
  }
  return {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(size_ - first)};
}

void LevelNeighbourhood::choose(const Square& square) {
  if (index_.size() < chosen_ + kBlock) {
    index_.resize(2 * chosen_ + kBlock);
    chosen_x3_.resize(index_.size() + kBlock);
    chosen_y3_.resize(index_.size() + kBlock);
  }
  // Always four: faster than to count.
  std::copy_n(&x3_[square.first], kTriangles, &chosen_x3_[chosen_]);
  std::copy_n(&y3_[square.first], kTriangles, &chosen_y3_[chosen_]);
  for (std::uint32_t k = 0; k < kTriangles; ++k) index_[chosen_ + k] = square.first + k;
  chosen_ += square.count;
}

BTMS_WIDE std::size_t LevelNeighbourhood::find(double x3, double y3, double reach3, std::uint32_t* found) const {
  // A little more than the reach: floats round products, and positions far from the corner of a huge tile.
  constexpr double kProducts = 1.001, kPositions = 0x1p-22;
  const auto x = static_cast<float>(x3), y = static_cast<float>(y3);
  const double reach = reach3 * kProducts + (std::abs(x3) + std::abs(y3) + 4 * reach3) * kPositions;
  const auto squared = static_cast<float>(reach * reach);
  std::size_t n = 0;
  for (std::size_t i = 0; i < chosen_; i += kBlock) {
    std::array<std::uint32_t, kBlock> is_near;
    for (std::size_t k = 0; k < kBlock; ++k) {
      const float dx = chosen_x3_[i + k] - x, dy = chosen_y3_[i + k] - y;
      is_near[k] = dx * dx + dy * dy < squared ? 1 : 0;
    }
    // Nobody can foretell which: no branch.
    const std::size_t end = std::min(kBlock, chosen_ - i);
    for (std::size_t k = 0; k < end; ++k) {
      found[n] = index_[i + k];
      n += is_near[k];
    }
  }
  return n;
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
                                     LevelCompletionScratch& scratch) {
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
  if (scratch.terms.size() <= near.chosen()) {
    scratch.terms.resize(near.chosen() + 1);
    scratch.found.resize(near.chosen() + 1);
  }
  const std::int64_t rise_mm = std::max(near.highest_mm() - static_cast<std::int64_t>(lowest_datum),
                                        static_cast<std::int64_t>(highest_datum) - near.lowest_mm());

  // On the first level the radius may double twice.
  const double enough = rules.first() ? 1e-3 * kKernelUnit : 0;
  double largest = round_half_up(q.level_kernel_radius * rules.r_mm());
  Lanes radius = Lanes{} + largest;
  TermSums sums;
  std::size_t n = 0;
  for (int doublings = rules.first() ? 2 : 0;; --doublings) {
    // Centroids are r / 3 from the centre.
    if (q.completion == Completion::kKernel)
      n = near.find(3.0 * centre_x_mm, 3.0 * centre_y_mm, 3 * largest + rules.r_mm(), scratch.found.data());
    sums = weigh(near, {scratch.found.data(), n}, to, radius, rules.first() ? q.first_tilt : q.tilt, rise_mm,
                 scratch.terms.data());
    const LongLanes few = wants & (to_lanes(sums.k) <= enough);
    if (doublings == 0 || !any_lane(few)) break;
    radius = few ? 2.0 * radius : radius;
    largest *= 2;
  }
  const std::span<const LevelTerms> used{scratch.terms.data(), n};
  const Lanes s = to_lanes(sums.k), z = to_lanes(sums.kz);
  const Lanes shrunk = z / (s + (rules.first() ? 0.0 : q.shrink * kKernelUnit)), sd = spread(used, s > 0.0 ? z / s : Lanes{});
  const Lanes support = s / kKernelUnit;
  const Lanes weight = (q.completed_weight * support / (support + 1.0) + q.least_weight) * kWeightUnit;
  const PriorPlane none;
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    if (!wanted[t]) continue;
    LevelNode& node = nodes[t];
    if (sums.k[t] == 0) {
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
