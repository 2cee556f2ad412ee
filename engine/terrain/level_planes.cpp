#include "engine/terrain/level_planes.h"

#include <algorithm>
#include <cmath>

#include "engine/lattice/lanes.h"
#include "engine/terrain/lane_moments.h"
#include "engine/terrain/moments.h"

namespace btms {
namespace {

static_assert(GatedPoints::kLanes == kLanes);
constexpr int kWeightOne = 256;
constexpr int kWeightSteps = 256;  // residuals up to 4 s in this many steps
constexpr double kCutOff = 4;
constexpr double kSteepestFit = 7.9;

constexpr double kPadding_mm = 1 << 30;  // a height far above any plane
constexpr double kLargestSquare_mm2 = 1 << 30;
// Terms of a sum are below 2^41 (a weight and two coordinates of 15 bits, or one and a height of 18), so this many
// add up in doubles without rounding.
constexpr std::size_t kExactPoints = 1 << 10;

struct LanePlane {
  Lanes a{}, b{}, c{};
};

// Steps of weight per 2^-12 mm of residual, a multiple of 2^-32.
constexpr double kStepUnit = 4294967296.0;
double weight_steps(double scale_mm) {
  return std::floor(kWeightSteps / (kCutOff * scale_mm * FixedLevelPlane::kUnit) * kStepUnit + 0.5) / kStepUnit;
}

// The weight of a residual of so many steps, a multiple of 2^-32: 256 / (1 + q^4), q in the middle of the step,
// rounded. Division is as fast as looking it up, and lanes need no table.
BTMS_INLINE Lanes weight_of(const Lanes& steps) {
  const Lanes none{}, some = steps > 0.0 ? steps : none;
  constexpr double kHalf = 0.5 - 1 / (2 * kStepUnit);  // of a step: so that rounding rounds down
  const Lanes middle = ((some - kHalf) + kIntegerMagic) - kIntegerMagic + 0.5, square = middle * middle;
  constexpr double kQuarter = kWeightSteps / kCutOff, kOne = kQuarter * kQuarter * kQuarter * kQuarter;
  const Lanes w = (kWeightOne * kOne / (square * square + kOne) + kIntegerMagic) - kIntegerMagic;
  return steps < double{kWeightSteps} ? w : none;
}

struct WeightedMoments {
  LongLanes n{}, x{}, y{}, z{}, xx{}, xy{}, xz{}, yy{}, yz{}, rr{};
};

BTMS_INLINE WeightedMoments weigh(const GatedPoints& p, std::size_t longest, const LanePlane& plane,
                                  const Lanes& steps_per_residual, bool with_residuals) {
  WeightedMoments m;
  for (std::size_t begin = 0; begin < longest; begin += kExactPoints) {
    const std::size_t end = std::min(begin + kExactPoints, longest);
    Lanes n{}, sx{}, sy{}, sz{}, xx{}, xy{}, xz{}, yy{}, yz{}, rr{};
    for (std::size_t i = begin * kLanes; i < end * kLanes; i += kLanes) {
      const Lanes x = load_lanes(p.x_mm() + i), y = load_lanes(p.y_mm() + i), z = load_lanes(p.z_mm() + i);
      const Lanes e = z * FixedLevelPlane::kUnit - (plane.a * x + plane.b * y + plane.c);
      const Lanes w = weight_of(e * steps_per_residual);
      const Lanes wx = w * x, wy = w * y;
      n += w;
      sx += wx;
      sy += wy;
      sz += w * z;
      xx += wx * x;
      xy += wx * y;
      xz += wx * z;
      yy += wy * y;
      yz += wy * z;
      if (!with_residuals) continue;
      const Lanes r = floor_lanes(e / FixedLevelPlane::kUnit), square = r * r;
      rr += w * (square < kLargestSquare_mm2 ? square : Lanes{} + kLargestSquare_mm2);
    }
    m.n += small_integers(n);
    m.x += small_integers(sx);
    m.y += small_integers(sy);
    m.z += small_integers(sz);
    m.xx += small_integers(xx);
    m.xy += small_integers(xy);
    m.xz += small_integers(xz);
    m.yy += small_integers(yy);
    m.yz += small_integers(yz);
    m.rr += small_integers(rr);
  }
  return m;
}

}  // namespace

std::int64_t GatedPoints::assign(std::size_t lane, const NodePoints& p, std::int32_t datum_mm,
                                 const FixedLevelPlane& gate) {
  if (x_.size() < (p.size + 1) * kLanes) {
    x_.resize((p.size + 1) * kLanes);
    y_.resize((p.size + 1) * kLanes);
    z_.resize((p.size + 1) * kLanes);
  }
  std::int64_t lowest = INT64_MAX;
  std::size_t n = 0;
  for (std::size_t i = 0; i < p.size; ++i) {
    const std::int64_t z =
        std::clamp<std::int64_t>(std::int64_t{p.z_mm[i]} - datum_mm, -kMaxNodeRelief_mm, kMaxNodeRelief_mm);
    const std::int64_t above = gate.above(p.x_mm[i], p.y_mm[i], z);
    const std::size_t to = n * kLanes + lane;
    x_[to] = p.x_mm[i];
    y_[to] = p.y_mm[i];
    z_[to] = static_cast<double>(z);
    n += above >= 0;
    lowest = std::min(lowest, above >= 0 ? above : INT64_MAX);
  }
  size_[lane] = n;
  return lowest;
}

std::size_t GatedPoints::longest() const { return *std::max_element(size_.begin(), size_.end()); }

void GatedPoints::pad() {
  const std::size_t end = longest() * kLanes;
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    for (std::size_t i = size_[lane] * kLanes + lane; i < end; i += kLanes) x_[i] = y_[i] = 0, z_[i] = kPadding_mm;
}

BTMS_WIDE std::array<FittedPlane, GatedPoints::kLanes> fit_planes(const GatedPoints& points, const PlaneStarts& starts,
                                                                  const PlaneFitRules& rules) {
  const std::size_t longest = points.longest();
  LanePlane plane;
  Lanes prior_x{}, prior_y{}, steps{}, last_steps{};
  for (std::size_t k = 0; k < kLanes; ++k) {
    plane.a[k] = static_cast<double>(starts[k].plane.a);
    plane.b[k] = static_cast<double>(starts[k].plane.b);
    plane.c[k] = static_cast<double>(starts[k].plane.c);
    prior_x[k] = starts[k].slope_x;
    prior_y[k] = starts[k].slope_y;
    steps[k] = weight_steps(starts[k].scale_mm);
    last_steps[k] = weight_steps(starts[k].last_scale_mm);
  }
  Lanes gx{}, gy{}, mx{}, my{}, mz{}, weight{}, mean_square{};
  LongLanes fitted = LongLanes{} - 1;
  for (int fit = 0; fit < rules.fits; ++fit) {
    const bool last = fit == rules.fits - 1;
    const WeightedMoments m = weigh(points, longest, plane, last ? last_steps : steps, last);
    const Lanes n = to_lanes(m.n), n2 = n * n;
    weight = n / double{kWeightOne};
    fitted &= weight >= rules.least_weight;
    if (!any_lane(fitted)) break;
    mx = to_lanes(m.x) / n;
    my = to_lanes(m.y) / n;
    mz = to_lanes(m.z) / n;
    // Covariances (mm^2) times the weight, plus the ridge towards the prior's slope.
    const Lanes ridge = rules.ridge_per_weight ? rules.ridge_mm2 * (1.0 / weight) : Lanes{} + rules.ridge_mm2;
    const Lanes cxx = central(m.n, m.xx, m.x, m.x) / n2 + ridge, cxy = central(m.n, m.xy, m.x, m.y) / n2;
    const Lanes cyy = central(m.n, m.yy, m.y, m.y) / n2 + ridge;
    const Lanes cxz = central(m.n, m.xz, m.x, m.z) / n2 + ridge * prior_x;
    const Lanes cyz = central(m.n, m.yz, m.y, m.z) / n2 + ridge * prior_y;
    const Lanes det = cxx * cyy - cxy * cxy;
    gx = clamp_lanes((cxz * cyy - cyz * cxy) / det, kSteepestFit);
    gy = clamp_lanes((cyz * cxx - cxz * cxy) / det, kSteepestFit);
    plane = {floor_lanes(gx * FixedLevelPlane::kUnit + 0.5), floor_lanes(gy * FixedLevelPlane::kUnit + 0.5),
             floor_lanes((mz - gx * mx - gy * my) * FixedLevelPlane::kUnit + 0.5)};
    mean_square = to_lanes(m.rr) / n;
  }
  std::array<FittedPlane, kLanes> out;
  for (std::size_t k = 0; k < kLanes; ++k)
    out[k] = {fitted[k] != 0, mx[k], my[k], mz[k], gx[k], gy[k], weight[k], std::sqrt(mean_square[k])};
  return out;
}

}  // namespace btms
