#include "engine/terrain/completion.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/lattice/lanes.h"
#include "engine/lattice/lattice.h"
#include "engine/lattice/wide.h"
#include "engine/terrain/kernel.h"
#include "engine/terrain/node_model.h"

namespace btms {
namespace {

constexpr double kDirectionUnit = 1 << 24;  // unit vectors in Eq 10's sum
constexpr double kGradientUnit = 1 << 12;   // slopes in the ridge
constexpr double kMaxSpread_mm = 1 << 14;   // residuals beyond 16 m count as 16 m
constexpr int kReliefBits = 18;             // heights within a kernel differ by less than 262 m
constexpr double kMaxRelief_mm = 1 << kReliefBits;
constexpr int kMostMomentBits = 22;  // with squared spreads and their number: 61 bits
constexpr int kNeighbourBits = 11;   // fewer nodes than that within 10 r

// The neighbours that a square's predictions may use, structure of arrays, filled up to whole lanes with some that no
// kernel reaches; kernel values are those of the node at hand.
class Terms {
 public:
  enum Field : std::size_t { kX, kY, kZ, kNormalX, kNormalY, kNormalZ, kSlopeX, kSlopeY, kWeight, kKernel, kFields };

  Terms(std::span<const Neighbour> terrain, std::span<const std::uint32_t> near, double x_mm, double y_mm,
        double reach_mm2, CompletionScratch& s) {
    if (s.index.size() < near.size()) {
      s.index.resize(near.size());
      s.terms.resize((near.size() + kLanes) * kFields);
    }
    std::uint32_t* index = s.index.data();
    std::size_t n = 0;  // not the member, which every store could be to
    for (const std::uint32_t i : near) {
      const double dx = terrain[i].x_mm - x_mm, dy = terrain[i].y_mm - y_mm;
      index[n] = i;
      n += dx * dx + dy * dy < reach_mm2;
    }
    size_ = n;
    stride_ = (size_ + kLanes - 1) / kLanes * kLanes;
    values_ = s.terms.data();
    for (std::size_t i = 0; i < size_; ++i) set(i, terrain[index[i]]);
    for (std::size_t i = size_; i < stride_; ++i) set(i, {x_mm + kFarAway_mm, y_mm, 0, 0, 0, 0, 0, 0, 0});
  }
  std::size_t size() const { return size_; }
  std::size_t end() const { return stride_; }  // of steps of kLanes
  double first(Field f) const { return values_[f * stride_]; }

  BTMS_INLINE Lanes at(Field f, std::size_t i) const { return load_lanes(values_ + f * stride_ + i); }
  BTMS_INLINE void set_kernel(std::size_t i, const Lanes& k) { store_lanes(values_ + kKernel * stride_ + i, k); }
  // Largest distance of a field from `from`.
  BTMS_INLINE double farthest(Field f, double from) const {
    Lanes most{};
    for (std::size_t i = 0; i + kLanes <= size_; i += kLanes) {
      const Lanes away = abs_lanes(at(f, i) - from);
      most = most > away ? most : away;
    }
    double out = std::max(std::max(most[0], most[1]), std::max(most[2], most[3]));
    for (std::size_t i = size_ - size_ % kLanes; i < size_; ++i)
      out = std::max(out, std::abs(values_[f * stride_ + i] - from));
    return out;
  }

 private:
  static constexpr double kFarAway_mm = 1 << 30;

  BTMS_INLINE void set(std::size_t i, const Neighbour& n) {
    double* to = values_ + i;
    to[kX * stride_] = n.x_mm;
    to[kY * stride_] = n.y_mm;
    to[kZ * stride_] = n.z_mm;
    to[kNormalX * stride_] = n.normal_x;
    to[kNormalY * stride_] = n.normal_y;
    to[kNormalZ * stride_] = n.normal_z;
    to[kSlopeX * stride_] = n.slope_x;
    to[kSlopeY * stride_] = n.slope_y;
    to[kWeight * stride_] = n.weight;
  }

  double* values_;
  std::size_t size_ = 0, stride_ = 0;
};

// Where a node is predicted: m_j, mm.
struct Place {
  double x, y, z;
};

struct Prediction {
  double z_mm = 0;
  Eigen::Vector3d normal{0, 0, 1};
  bool valid = false;
};

template <class Sum>
BTMS_INLINE double total(const Sum& v) {
  return static_cast<double>((v[0] + v[1]) + (v[2] + v[3]));
}
BTMS_INLINE Lanes round_lanes(const Lanes& v) { return floor_lanes(v + 0.5); }  // as round_half_up()

// Kernel values in 2^-bits, rounded.
BTMS_INLINE Lanes coarse(const Lanes& k, int bits) {
  const double unit = static_cast<double>(1 << (kKernelBits - bits));
  return floor_lanes((k + unit / 2) * (1 / unit));
}

// Sums of Eq 8 and Eq 11.
struct Means {
  std::int64_t support = 0, z = 0;
  Eigen::Vector3d normal{0, 0, 0};
};

// Eq 7 for a centroid in thirds of a millimetre, exact; and the sums over it.
template <class Sum>
BTMS_INLINE Means weigh(Terms& terms, double x3, double y3, const CompletionRules& rules, double datum_mm) {
  const auto reach9 = static_cast<double>(rules.reach9_mm2);
  Sum support{}, z{}, nx{}, ny{}, nz{};
  for (std::size_t i = 0; i < terms.end(); i += kLanes) {
    const Lanes dx3 = 3.0 * terms.at(Terms::kX, i) - x3, dy3 = 3.0 * terms.at(Terms::kY, i) - y3;
    const Lanes d9 = dx3 * dx3 + dy3 * dy3;
    const Lanes t = sqrt_lanes(d9) * rules.per_third_mm;
    const Lanes all = floor_lanes(kernel_polynomial(t) * kKernelUnit + 0.5);
    const Lanes k = (d9 < reach9) & (t < 1.0) ? all : Lanes{};
    terms.set_kernel(i, k);
    support += lanes_to<Sum>(k);
    z += lanes_to<Sum>(k) * lanes_to<Sum>(terms.at(Terms::kZ, i) - datum_mm);
    const Sum kw = lanes_to<Sum>(floor_lanes(k * (terms.at(Terms::kWeight, i) * (1 / kWeightUnit))));
    nx += kw * lanes_to<Sum>(terms.at(Terms::kNormalX, i));
    ny += kw * lanes_to<Sum>(terms.at(Terms::kNormalY, i));
    nz += kw * lanes_to<Sum>(terms.at(Terms::kNormalZ, i));
  }
  Means m;
  m.support = static_cast<std::int64_t>((support[0] + support[1]) + (support[2] + support[3]));
  m.z = static_cast<std::int64_t>((z[0] + z[1]) + (z[2] + z[3])) + m.support * static_cast<std::int64_t>(datum_mm);
  m.normal = {total(nx), total(ny), total(nz)};
  return m;
}

// Eq 9-10: each neighbour proposes the normal perpendicular to the line from its mean to m_j.
template <class Sum>
BTMS_INLINE Prediction faithful(const Terms& terms, const Place& m) {
  Sum sx{}, sy{}, sz{};
  for (std::size_t i = 0; i < terms.end(); i += kLanes) {
    const Lanes dx = m.x - terms.at(Terms::kX, i), dy = m.y - terms.at(Terms::kY, i), dz = m.z - terms.at(Terms::kZ, i);
    const Lanes flat2 = dx * dx + dy * dy;
    // (-dx dz, -dy dz, flat^2), to unit length
    const Lanes scale = kDirectionUnit / sqrt_lanes(flat2 * (flat2 + dz * dz));
    // d_xy = 0 leaves Eq 9 undefined: the neighbour's own normal stands in.
    constexpr double kOwn = kDirectionUnit / kNormalUnit;
    const Lanes ux = flat2 > 0.0 ? -dx * dz * scale : terms.at(Terms::kNormalX, i) * kOwn;
    const Lanes uy = flat2 > 0.0 ? -dy * dz * scale : terms.at(Terms::kNormalY, i) * kOwn;
    const Lanes uz = flat2 > 0.0 ? flat2 * scale : terms.at(Terms::kNormalZ, i) * kOwn;
    const Sum k = lanes_to<Sum>(terms.at(Terms::kKernel, i));
    sx += k * lanes_to<Sum>(round_lanes(ux));
    sy += k * lanes_to<Sum>(round_lanes(uy));
    sz += k * lanes_to<Sum>(round_lanes(uz));
  }
  // The common factors cancel: only the direction of the sum counts. z components are never negative.
  const Eigen::Vector3d sum{total(sx), total(sy), total(sz)};
  const double length = std::sqrt(sum.x() * sum.x() + sum.y() * sum.y() + sum.z() * sum.z());
  if (!(length > 0)) return {};
  return {m.z, sum / length, true};
}

// Weighted least squares over the same neighbours, exact on a plane:
//   min over z, g of  sum k (z_i - z - g D_i)^2 + ridge sum k |g - g_i|^2
// The ridge lets the neighbours' own slopes speak where their positions don't span a plane.
template <class Sum>
BTMS_INLINE Prediction plane(const Terms& terms, const Place& m, const CompletionRules& rules) {
  Sum n{}, sx{}, sy{}, sz{}, sxx{}, sxy{}, syy{}, sxz{}, syz{}, sgx{}, sgy{};
  for (std::size_t i = 0; i < terms.end(); i += kLanes) {
    const Sum k = lanes_to<Sum>(coarse(terms.at(Terms::kKernel, i), rules.moment_bits));
    const Sum dx = lanes_to<Sum>(terms.at(Terms::kX, i) - m.x), dy = lanes_to<Sum>(terms.at(Terms::kY, i) - m.y);
    const Sum dz = lanes_to<Sum>(clamp_lanes(terms.at(Terms::kZ, i) - m.z, kMaxRelief_mm));
    const Sum kx = k * dx, ky = k * dy;
    n += k;
    sx += kx;
    sy += ky;
    sz += k * dz;
    sxx += kx * dx;
    sxy += kx * dy;
    syy += ky * dy;
    sxz += kx * dz;
    syz += ky * dz;
    sgx += k * lanes_to<Sum>(terms.at(Terms::kSlopeX, i));
    sgy += k * lanes_to<Sum>(terms.at(Terms::kSlopeY, i));
  }
  const double w = total(n), ridge_mm2 = rules.ridge_mm2;
  if (!(w > 0)) return {};
  const double mx = total(sx) / w, my = total(sy) / w, mz = total(sz) / w;
  const double cxx = total(sxx) / w - mx * mx + ridge_mm2, cxy = total(sxy) / w - mx * my;
  const double cyy = total(syy) / w - my * my + ridge_mm2;
  const double cxz = total(sxz) / w - mx * mz + ridge_mm2 * (total(sgx) / kGradientUnit / w);
  const double cyz = total(syz) / w - my * mz + ridge_mm2 * (total(sgy) / kGradientUnit / w);
  const double det = cxx * cyy - cxy * cxy;  // > 0: the ridge is positive and the scatter is not negative
  const double gx = (cxz * cyy - cyz * cxy) / det, gy = (cyz * cxx - cxz * cxy) / det;
  const double length = std::sqrt(1 + gx * gx + gy * gy);
  if (!(det > 0) || !(length < 1e6)) return {};
  return {m.z + mz - gx * mx - gy * my, {-gx / length, -gy / length, 1 / length}, true};
}

struct Spread {
  double sum = 0, weight = 0;
};
// Of the neighbours' heights around the predicted plane, squared. Doubles don't hold sums from 2^53 on.
template <class Sum>
BTMS_INLINE Spread spread(const Terms& terms, const Place& m, const Prediction& p, const CompletionRules& rules) {
  const double gx = -p.normal.x() / p.normal.z(), gy = -p.normal.y() / p.normal.z();
  Sum n{}, sum{};
  for (std::size_t i = 0; i < terms.end(); i += kLanes) {
    const Lanes expected = p.z_mm + gx * (terms.at(Terms::kX, i) - m.x) + gy * (terms.at(Terms::kY, i) - m.y);
    const Sum e = lanes_to<Sum>(round_lanes(clamp_lanes(terms.at(Terms::kZ, i) - expected, kMaxSpread_mm)));
    const Sum k = lanes_to<Sum>(coarse(terms.at(Terms::kKernel, i), rules.moment_bits));
    n += k;
    sum += k * e * e;
  }
  return {total(sum), total(n)};
}

// Largest size of the terms' heights and slopes, which tells how large sums over them can get.
struct Extremes {
  double datum_mm, relief_mm, slope;
};

BTMS_INLINE void predict(Node& node, double x3, double y3, std::int32_t centre_x_mm, std::int32_t centre_y_mm,
                         Terms& terms, const Extremes& extremes, const CompletionRules& rules) {
  const double n = static_cast<double>(terms.size());
  const bool low = n * kKernelUnit * std::max(extremes.relief_mm, kNormalUnit) < kExactInDouble;
  const Means means =
      low ? weigh<Lanes>(terms, x3, y3, rules, extremes.datum_mm) : weigh<LongLanes>(terms, x3, y3, rules, 0);
  if (means.support == 0) return;
  const auto support = static_cast<double>(means.support);
  node.support = saturate_u16(static_cast<double>(means.support >> (kKernelBits - 8)));

  // Eq 8, above the centroid to the millimetre
  const Place m{std::floor((x3 + 1) / 3), std::floor((y3 + 1) / 3),
                round_half_up(static_cast<double>(means.z) / support)};
  // Eq 9-10, or the plane-exact form
  Prediction p;
  if (rules.normals == CompletionNormals::kFaithful) {
    p = support * kDirectionUnit < kExactInDouble ? faithful<Lanes>(terms, m) : faithful<LongLanes>(terms, m);
  } else {
    // A kernel value rounds up by less than 1; |dz| is at most twice the relief, for m.z is a mean.
    const double reach = rules.radius_mm + 1, high = std::min(2 * extremes.relief_mm + 1, kMaxRelief_mm);
    const double weight = support / (1 << (kKernelBits - rules.moment_bits)) + n;
    p = weight * std::max(reach * std::max(reach, high), extremes.slope) < kExactInDouble
            ? plane<Lanes>(terms, m, rules)
            : plane<LongLanes>(terms, m, rules);
  }
  if (!p.valid || !(p.normal.z() > 0)) return;
  Spread s = spread<Lanes>(terms, m, p, rules);
  if (s.sum >= kExactInDouble) s = spread<LongLanes>(terms, m, p, rules);
  node.sd_mm = saturate_u16(s.weight > 0 ? std::sqrt(s.sum / s.weight) : 0);

  // Eq 11, clamped below at 0
  const double agreement =
      means.normal.x() * p.normal.x() + means.normal.y() * p.normal.y() + means.normal.z() * p.normal.z();
  const std::uint16_t weight = saturate_u16(agreement / kNormalUnit / support * kWeightUnit);

  Node candidate = node;
  set_normal(candidate, p.normal);
  if (means.support <= rules.min_support || weight == 0 || normal_xy_squared(candidate) > rules.steepest_normal_xy2)
    return;

  // n^o becomes n^t. What stood here before decides whether it is free.
  const double own_x = centre_x_mm + node.mean_x_mm, own_y = centre_y_mm + node.mean_y_mm;
  const double surface = p.z_mm - (p.normal.x() * (own_x - m.x) + p.normal.y() * (own_y - m.y)) / p.normal.z();
  candidate.occupied = node.count > 0 && node.mean_z_mm - surface > rules.standing_mm;
  candidate.node_class = NodeClass::kPredicted;
  candidate.weight = weight;
  candidate.mean_x_mm = static_cast<std::int16_t>(m.x - centre_x_mm);
  candidate.mean_y_mm = static_cast<std::int16_t>(m.y - centre_y_mm);
  candidate.mean_z_mm = height_mm(p.z_mm);
  node = candidate;
}

}  // namespace

CompletionRules::CompletionRules(const Parameters& p)
    : completion(p.completion),
      normals(p.completion_normals),
      min_support(std::max<std::int64_t>(static_cast<std::int64_t>(round_half_up(p.min_support * kKernelUnit)),
                                         static_cast<std::int64_t>(1e-6 * kKernelUnit))),
      steepest_normal_xy2(btms::steepest_normal_xy2(p.slope_max_deg)),
      resolution_mm(btms::resolution_mm(p)),
      standing_mm(static_cast<std::int32_t>(round_half_up(p.terrain_distance_m * 1000))) {
  radius_mm = round_half_up(p.kernel_radius * resolution_mm);
  const auto l = static_cast<std::int64_t>(radius_mm);
  reach9_mm2 = 9 * l * l;
  per_third_mm = 1 / (3 * radius_mm);
  const double square_reach_mm = radius_mm + resolution_mm / 3.0 + 1;
  square_reach_mm2 = square_reach_mm * square_reach_mm;
  ridge_mm2 = 0.25 * resolution_mm * resolution_mm;
  const int reach_bits = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(l)));
  moment_bits = std::min(kMostMomentBits, 62 - kNeighbourBits - reach_bits - std::max(reach_bits, kReliefBits));
}

std::int32_t CompletionRules::halo() const {
  const auto l = static_cast<std::int64_t>(radius_mm);
  return static_cast<std::int32_t>(ceil_div(6 * l - resolution_mm, 6 * std::int64_t{resolution_mm}));
}

Neighbour neighbour_of(const Node& node, std::int32_t x_mm, std::int32_t y_mm) {
  const Eigen::Vector3d normal = normal_of(node);
  return {static_cast<double>(x_mm),
          static_cast<double>(y_mm),
          static_cast<double>(node.mean_z_mm),
          static_cast<double>(node.normal_x),
          static_cast<double>(node.normal_y),
          round_half_up(normal.z() * kNormalUnit),
          round_half_up(-normal.x() / normal.z() * kGradientUnit),
          round_half_up(-normal.y() / normal.z() * kGradientUnit),
          static_cast<double>(node.weight)};
}

BTMS_WIDE void predict_square(Node* square, std::int32_t centre_x_mm, std::int32_t centre_y_mm,
                              std::span<const Neighbour> terrain, std::span<const std::uint32_t> near,
                              const CompletionRules& rules, CompletionScratch& scratch) {
  Terms terms(terrain, near, centre_x_mm, centre_y_mm, rules.square_reach_mm2, scratch);
  if (terms.size() == 0) return;
  const double datum = terms.first(Terms::kZ);
  const Extremes extremes{datum, terms.farthest(Terms::kZ, datum),
                          std::max(terms.farthest(Terms::kSlopeX, 0), terms.farthest(Terms::kSlopeY, 0))};
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    if (square[t].node_class == NodeClass::kTerrain) continue;
    // x_j, the centroid, in thirds of a millimetre
    const std::int64_t x3 = 3 * std::int64_t{centre_x_mm} + centroid_x3(t, rules.resolution_mm);
    const std::int64_t y3 = 3 * std::int64_t{centre_y_mm} + centroid_y3(t, rules.resolution_mm);
    predict(square[t], static_cast<double>(x3), static_cast<double>(y3), centre_x_mm, centre_y_mm, terms, extremes,
            rules);
  }
}

}  // namespace btms
