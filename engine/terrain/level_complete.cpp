#include "engine/terrain/level_complete.h"

#include <algorithm>
#include <cmath>

#include "engine/lattice/lattice.h"
#include "engine/terrain/kernel.h"

namespace btms {
namespace {

constexpr std::int64_t kMaxSpread_mm = 1 << 14;
constexpr int kSpreadBits = 12;  // kernel values in squared spreads

void place_at_centroid(LevelNode& node, std::uint8_t t, double z, const PriorPlane& prior, const LevelRules& rules) {
  node.mean_x_mm = static_cast<std::int16_t>(floor_div(centroid_x3(t, rules.r_mm()) + 1, 3));
  node.mean_y_mm = static_cast<std::int16_t>(floor_div(centroid_y3(t, rules.r_mm()) + 1, 3));
  node.mean_z_mm = height_mm(z);
  node.slope_x = stored_slope(prior.slope_x);
  node.slope_y = stored_slope(prior.slope_y);
}

}  // namespace

void LevelNeighbourhood::clear() {
  x_mm.clear();
  y_mm.clear();
  z_mm.clear();
  slope_x.clear();
  slope_y.clear();
  weight.clear();
}

void LevelNeighbourhood::add(const LevelNode& node, std::int32_t x, std::int32_t y) {
  x_mm.push_back(x);
  y_mm.push_back(y);
  z_mm.push_back(node.mean_z_mm);
  slope_x.push_back(node.slope_x);
  slope_y.push_back(node.slope_y);
  weight.push_back(node.weight);
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

void complete_level_node(LevelNode& node, std::uint8_t t, std::int32_t centre_x_mm, std::int32_t centre_y_mm,
                         const LevelNeighbourhood& near, const PriorPlane& given, const LevelRules& rules,
                         std::vector<LevelTerm>& terms) {
  const LevelParameters& q = rules.p();
  const PriorPlane prior = rules.first() ? PriorPlane{} : given;
  const std::int64_t x3 = 3 * std::int64_t{centre_x_mm} + centroid_x3(t, rules.r_mm());
  const std::int64_t y3 = 3 * std::int64_t{centre_y_mm} + centroid_y3(t, rules.r_mm());
  const double p = prior.at(static_cast<double>(centroid_x3(t, rules.r_mm())) / 3,
                            static_cast<double>(centroid_y3(t, rules.r_mm())) / 3);
  const auto datum = static_cast<std::int64_t>(round_half_up(p));
  const double tilt = rules.first() ? q.first_tilt : q.tilt;

  std::int64_t sum = 0, weighted = 0;
  for (int doubling = 0; doubling < (rules.first() ? 3 : 1); ++doubling) {
    const double radius = round_half_up(q.level_kernel_radius * rules.r_mm()) * (1 << doubling);
    const auto radius_mm = static_cast<std::int64_t>(radius);
    terms.clear();
    sum = weighted = 0;
    for (std::size_t i = 0; i < near.size(); ++i) {
      const std::int64_t dx3 = 3 * std::int64_t{near.x_mm[i]} - x3, dy3 = 3 * std::int64_t{near.y_mm[i]} - y3;
      const std::int64_t d9 = dx3 * dx3 + dy3 * dy3;
      if (d9 >= 9 * radius_mm * radius_mm) continue;
      const std::int64_t k = (kernel(std::sqrt(static_cast<double>(d9)) / 3 / radius) * near.weight[i]) >> 16;
      if (k == 0) continue;
      // Its height, and a share of what its plane says of this place.
      const double lean = -(near.slope_x[i] / kSlopeUnit * static_cast<double>(dx3) +
                            near.slope_y[i] / kSlopeUnit * static_cast<double>(dy3)) /
                          3;
      const std::int64_t z = near.z_mm[i] - datum + static_cast<std::int64_t>(round_half_up(tilt * lean));
      terms.push_back({k, z});
      sum += k;
      weighted += k * z;
    }
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
  const double s = static_cast<double>(sum);
  const double mean = static_cast<double>(weighted) / s;
  const double shrunk = static_cast<double>(weighted) / (s + (rules.first() ? 0 : q.shrink * kKernelUnit));
  const auto middle = static_cast<std::int64_t>(round_half_up(mean));
  std::int64_t squares = 0, coarse_sum = 0;
  for (const LevelTerm& term : terms) {
    const std::int64_t e = std::clamp(term.z - middle, -kMaxSpread_mm, kMaxSpread_mm);
    const std::int64_t k = (term.k + (1 << (kKernelBits - kSpreadBits - 1))) >> (kKernelBits - kSpreadBits);
    squares += k * e * e;
    coarse_sum += k;
  }
  place_at_centroid(node, t, p + (static_cast<double>(datum) - p) + shrunk, prior, rules);
  node.source = 0;
  const double support = s / kKernelUnit;
  node.weight = saturate_u16((q.completed_weight * support / (support + 1) + q.least_weight) * kWeightUnit);
  node.sd_mm =
      saturate_u16(coarse_sum > 0 ? std::sqrt(static_cast<double>(squares) / static_cast<double>(coarse_sum)) : 0);
}

}  // namespace btms
