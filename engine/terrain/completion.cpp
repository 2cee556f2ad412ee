#include "engine/terrain/completion.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/lattice/lattice.h"
#include "engine/terrain/kernel.h"
#include "engine/terrain/node_model.h"

namespace btms {
namespace {

constexpr double kDirectionUnit = 1 << 24;       // unit vectors in Eq 10's sum
constexpr double kGradientUnit = 1 << 12;        // slopes in the ridge
constexpr std::int64_t kMaxSpread_mm = 1 << 14;  // residuals beyond 16 m count as 16 m
constexpr int kReliefBits = 18;                  // heights within a kernel differ by less than 262 m
constexpr std::int64_t kMaxRelief_mm = 1 << kReliefBits;
constexpr int kMostMomentBits = 22;  // with squared spreads and their number: 61 bits
constexpr int kNeighbourBits = 11;   // fewer nodes than that within 10 r

// A kernel value in 2^-bits, rounded.
std::int64_t coarse(std::int64_t k, int bits) {
  return bits >= kKernelBits ? k : (k + (std::int64_t{1} << (kKernelBits - bits - 1))) >> (kKernelBits - bits);
}

struct Prediction {
  double z_mm = 0;
  Eigen::Vector3d normal{0, 0, 1};
  bool valid = false;
};

using Terms = std::vector<CompletionScratch::Term>;

// Eq 9-10: each neighbour proposes the normal perpendicular to the line from its mean to m_j.
Prediction faithful(const Terms& terms, const Neighbourhood& near, std::int64_t x, std::int64_t y, std::int64_t z) {
  std::int64_t sx = 0, sy = 0, sz = 0;
  for (const auto& [k, i] : terms) {
    const double dx = static_cast<double>(x - near.x_mm[i]), dy = static_cast<double>(y - near.y_mm[i]);
    const double dz = static_cast<double>(z - near.z_mm[i]);
    const double flat = std::sqrt(dx * dx + dy * dy);
    Eigen::Vector3d s;
    if (flat > 0) {
      const double length = std::sqrt(flat * flat + dz * dz);
      s = {-dx * dz / flat / length, -dy * dz / flat / length, flat / length};
    } else {
      // d_xy = 0 leaves Eq 9 undefined: the neighbour's own normal stands in.
      s = Eigen::Vector3d(near.normal_x[i], near.normal_y[i], near.normal_z[i]) / kNormalUnit;
    }
    sx += k * static_cast<std::int64_t>(round_half_up(s.x() * kDirectionUnit));
    sy += k * static_cast<std::int64_t>(round_half_up(s.y() * kDirectionUnit));
    sz += k * static_cast<std::int64_t>(round_half_up(s.z() * kDirectionUnit));
  }
  // The common factors cancel: only the direction of the sum counts. z components are never negative.
  const Eigen::Vector3d sum{static_cast<double>(sx), static_cast<double>(sy), static_cast<double>(sz)};
  const double length = std::sqrt(sum.x() * sum.x() + sum.y() * sum.y() + sum.z() * sum.z());
  if (!(length > 0)) return {};
  return {static_cast<double>(z), sum / length, true};
}

// Weighted least squares over the same neighbours, exact on a plane:
//   min over z, g of  sum k (z_i - z - g D_i)^2 + ridge sum k |g - g_i|^2
// The ridge lets the neighbours' own slopes speak where their positions don't span a plane.
Prediction plane(const Terms& terms, const Neighbourhood& near, std::int64_t x, std::int64_t y, std::int64_t z,
                 const CompletionRules& rules) {
  const double ridge_mm2 = rules.ridge_mm2;
  std::int64_t n = 0, sx = 0, sy = 0, sz = 0, sxx = 0, sxy = 0, syy = 0, sxz = 0, syz = 0, sgx = 0, sgy = 0;
  for (const auto& [k24, i] : terms) {
    const std::int64_t k = coarse(k24, rules.moment_bits);
    const std::int64_t dx = near.x_mm[i] - x, dy = near.y_mm[i] - y;
    const std::int64_t dz = std::clamp<std::int64_t>(near.z_mm[i] - z, -kMaxRelief_mm, kMaxRelief_mm);
    n += k;
    sx += k * dx;
    sy += k * dy;
    sz += k * dz;
    sxx += k * dx * dx;
    sxy += k * dx * dy;
    syy += k * dy * dy;
    sxz += k * dx * dz;
    syz += k * dy * dz;
    sgx += k * near.slope_x[i];
    sgy += k * near.slope_y[i];
  }
  if (n == 0) return {};
  const double w = static_cast<double>(n);
  const double mx = static_cast<double>(sx) / w, my = static_cast<double>(sy) / w, mz = static_cast<double>(sz) / w;
  const double cxx = static_cast<double>(sxx) / w - mx * mx + ridge_mm2, cxy = static_cast<double>(sxy) / w - mx * my;
  const double cyy = static_cast<double>(syy) / w - my * my + ridge_mm2;
  const double cxz =
      static_cast<double>(sxz) / w - mx * mz + ridge_mm2 * (static_cast<double>(sgx) / kGradientUnit / w);
  const double cyz =
      static_cast<double>(syz) / w - my * mz + ridge_mm2 * (static_cast<double>(sgy) / kGradientUnit / w);
  const double det = cxx * cyy - cxy * cxy;  // > 0: the ridge is positive and the scatter is not negative
  const double gx = (cxz * cyy - cyz * cxy) / det, gy = (cyz * cxx - cxz * cxy) / det;
  const double length = std::sqrt(1 + gx * gx + gy * gy);
  if (!(det > 0) || !(length < 1e6)) return {};
  return {static_cast<double>(z) + mz - gx * mx - gy * my, {-gx / length, -gy / length, 1 / length}, true};
}

// Spread of the neighbours' heights around the predicted plane.
double spread_mm(const Terms& terms, const Neighbourhood& near, std::int64_t x, std::int64_t y, const Prediction& p,
                 const CompletionRules& rules) {
  const double gx = -p.normal.x() / p.normal.z(), gy = -p.normal.y() / p.normal.z();
  std::int64_t n = 0, sum = 0;
  for (const auto& [k24, i] : terms) {
    const double expected =
        p.z_mm + gx * static_cast<double>(near.x_mm[i] - x) + gy * static_cast<double>(near.y_mm[i] - y);
    const double residual = std::clamp(round_half_up(near.z_mm[i] - expected), -static_cast<double>(kMaxSpread_mm),
                                       static_cast<double>(kMaxSpread_mm));
    const std::int64_t e = static_cast<std::int64_t>(residual), k = coarse(k24, rules.moment_bits);
    n += k;
    sum += k * e * e;
  }
  return n > 0 ? std::sqrt(static_cast<double>(sum) / static_cast<double>(n)) : 0;
}

}  // namespace

CompletionRules::CompletionRules(const Parameters& p)
    : normals(p.completion_normals),
      min_support(std::max<std::int64_t>(static_cast<std::int64_t>(round_half_up(p.min_support * kKernelUnit)),
                                         static_cast<std::int64_t>(1e-6 * kKernelUnit))),
      steepest_normal_xy2(btms::steepest_normal_xy2(p.slope_max_deg)),
      resolution_mm(btms::resolution_mm(p)),
      standing_mm(static_cast<std::int32_t>(round_half_up(p.terrain_distance_m * 1000))) {
  radius_mm = round_half_up(p.kernel_radius * resolution_mm);
  const auto l = static_cast<std::int64_t>(radius_mm);
  reach9_mm2 = 9 * l * l;
  ridge_mm2 = 0.25 * resolution_mm * resolution_mm;
  const int reach_bits = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(l)));
  moment_bits = std::min(kMostMomentBits, 62 - kNeighbourBits - reach_bits - std::max(reach_bits, kReliefBits));
}

std::int32_t CompletionRules::halo() const {
  const auto l = static_cast<std::int64_t>(radius_mm);
  return static_cast<std::int32_t>(ceil_div(6 * l - resolution_mm, 6 * std::int64_t{resolution_mm}));
}

void Neighbourhood::clear() {
  x_mm.clear();
  y_mm.clear();
  z_mm.clear();
  normal_x.clear();
  normal_y.clear();
  normal_z.clear();
  slope_x.clear();
  slope_y.clear();
  weight.clear();
}

void Neighbourhood::add(const Node& node, std::int32_t x, std::int32_t y) {
  x_mm.push_back(x);
  y_mm.push_back(y);
  z_mm.push_back(node.mean_z_mm);
  // Every neighbour serves many predictions: what its plane says is worked out once.
  const Eigen::Vector2d g = gradient_of(node);
  normal_x.push_back(node.normal_x);
  normal_y.push_back(node.normal_y);
  normal_z.push_back(static_cast<std::int32_t>(round_half_up(normal_of(node).z() * kNormalUnit)));
  slope_x.push_back(static_cast<std::int32_t>(round_half_up(g.x() * kGradientUnit)));
  slope_y.push_back(static_cast<std::int32_t>(round_half_up(g.y() * kGradientUnit)));
  weight.push_back(node.weight);
}

void predict(Node& node, std::uint8_t t, std::int32_t centre_x_mm, std::int32_t centre_y_mm, const Neighbourhood& near,
             const CompletionRules& rules, CompletionScratch& scratch) {
  // x_j, the centroid, in thirds of a millimetre for distances and to the millimetre as the position of m_j.
  const std::int64_t x3 = 3 * std::int64_t{centre_x_mm} + centroid_x3(t, rules.resolution_mm);
  const std::int64_t y3 = 3 * std::int64_t{centre_y_mm} + centroid_y3(t, rules.resolution_mm);
  const std::int64_t x = floor_div(x3 + 1, 3), y = floor_div(y3 + 1, 3);

  // Eq 7 and the sums of Eq 8 and 11.
  Terms& terms = scratch.terms;
  terms.clear();
  std::int64_t support = 0, sum_z = 0, sum_wx = 0, sum_wy = 0, sum_wz = 0;
  for (std::size_t i = 0; i < near.size(); ++i) {
    const std::int64_t dx3 = 3 * std::int64_t{near.x_mm[i]} - x3, dy3 = 3 * std::int64_t{near.y_mm[i]} - y3;
    const std::int64_t d9 = dx3 * dx3 + dy3 * dy3;
    if (d9 >= rules.reach9_mm2) continue;
    const std::int64_t k = kernel(std::sqrt(static_cast<double>(d9)) / 3 / rules.radius_mm);
    if (k == 0) continue;
    terms.push_back({k, static_cast<std::uint32_t>(i)});
    support += k;
    sum_z += k * near.z_mm[i];
    const std::int64_t kw = (k * near.weight[i]) >> 16;
    sum_wx += kw * near.normal_x[i];
    sum_wy += kw * near.normal_y[i];
    sum_wz += kw * near.normal_z[i];
  }
  if (support == 0) return;
  node.support = saturate_u16(static_cast<double>(support >> (kKernelBits - 8)));

  // Eq 8
  const auto z = static_cast<std::int64_t>(round_half_up(static_cast<double>(sum_z) / static_cast<double>(support)));
  // Eq 9-10, or the plane-exact form
  const Prediction p = rules.normals == CompletionNormals::kFaithful ? faithful(terms, near, x, y, z)
                                                                     : plane(terms, near, x, y, z, rules);
  if (!p.valid || !(p.normal.z() > 0)) return;
  node.sd_mm = saturate_u16(spread_mm(terms, near, x, y, p, rules));

  // Eq 11, clamped below at 0
  const double agreement = static_cast<double>(sum_wx) * p.normal.x() + static_cast<double>(sum_wy) * p.normal.y() +
                           static_cast<double>(sum_wz) * p.normal.z();
  const std::uint16_t weight = saturate_u16(agreement / kNormalUnit / static_cast<double>(support) * kWeightUnit);

  Node candidate = node;
  set_normal(candidate, p.normal);
  if (support <= rules.min_support || weight == 0 || normal_xy_squared(candidate) > rules.steepest_normal_xy2) return;

  // n^o becomes n^t. What stood here before decides whether it is free.
  const double own_x = centre_x_mm + node.mean_x_mm, own_y = centre_y_mm + node.mean_y_mm;
  const double surface =
      p.z_mm - (p.normal.x() * (own_x - static_cast<double>(x)) + p.normal.y() * (own_y - static_cast<double>(y))) /
                   p.normal.z();
  candidate.occupied = node.count > 0 && node.mean_z_mm - surface > rules.standing_mm;
  candidate.node_class = NodeClass::kPredicted;
  candidate.weight = weight;
  candidate.mean_x_mm = static_cast<std::int16_t>(x - centre_x_mm);
  candidate.mean_y_mm = static_cast<std::int16_t>(y - centre_y_mm);
  candidate.mean_z_mm = height_mm(p.z_mm);
  node = candidate;
}

}  // namespace btms
