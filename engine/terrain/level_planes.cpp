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
BTMS_INLINE Lanes weight_steps(const Lanes& scale_mm) {
  return floor_lanes(kWeightSteps / (kCutOff * scale_mm * FixedLevelPlane::kUnit) * kStepUnit + 0.5) / kStepUnit;
}

// A residual of so many steps, a multiple of 2^-32, weighs 256 / (1 + q^4), q in the middle of the step, rounded.
// Division is as fast as looking it up, and lanes need no table.
constexpr double kHalfStep = 0.5 - 1 / (2 * kStepUnit);  // so that rounding rounds down
BTMS_INLINE Lanes weight_of(const Lanes& steps_less_half) {
  // Added to a small number that is not negative, leaves an integer; half less than that is a double, too.
  constexpr double kMagic = 4503599627370496.0;  // 2^52
  const Lanes down = max_lanes(steps_less_half, Lanes{}), middle = (down + kMagic) - (kMagic - 0.5);
  const Lanes square = middle * middle;
  constexpr double kQuarter = kWeightSteps / kCutOff, kOne = kQuarter * kQuarter * kQuarter * kQuarter;
  const Lanes w = (kWeightOne * kOne / (square * square + kOne) + kIntegerMagic) - kIntegerMagic;
  return down < kWeightSteps - kHalfStep ? w : Lanes{};
}

// Integers. `Sum` is Lanes or, for many points, LongLanes.
template <class Sum>
struct WeightedMoments {
  Sum n{}, x{}, y{}, z{}, xx{}, xy{}, xz{}, yy{}, yz{}, rr{};

  // Of points [begin, end) of every lane; rr, squares of residuals, only if asked for.
  BTMS_INLINE static WeightedMoments of(const GatedPoints& p, std::size_t begin, std::size_t end,
                                        const LanePlane& plane, const Lanes& steps_per_residual, bool with_residuals) {
    WeightedMoments m;
    // Weights first: two short loops keep the CPU busier than one of a long chain.
    constexpr std::size_t kAtOnce = 16 * kLanes;
    std::array<double, kAtOnce> weights;
    const LanePlane in_steps{plane.a * steps_per_residual, plane.b * steps_per_residual,
                             plane.c * steps_per_residual + kHalfStep};
    const Lanes steps_per_mm = FixedLevelPlane::kUnit * steps_per_residual;
    for (std::size_t from = begin * kLanes; from < end * kLanes; from += kAtOnce) {
      const std::size_t to = std::min(from + kAtOnce, end * kLanes);
      for (std::size_t i = from; i < to; i += kLanes) {
        const Lanes x = load_lanes(p.x_mm() + i), y = load_lanes(p.y_mm() + i), z = load_lanes(p.z_mm() + i);
        store_lanes(&weights[i - from], weight_of(z * steps_per_mm - (in_steps.a * x + in_steps.b * y + in_steps.c)));
      }
      for (std::size_t i = from; i < to; i += kLanes) {
        const Lanes x = load_lanes(p.x_mm() + i), y = load_lanes(p.y_mm() + i), z = load_lanes(p.z_mm() + i);
        const Lanes w = load_lanes(&weights[i - from]), wx = w * x, wy = w * y;
        m.n += w;
        m.x += wx;
        m.y += wy;
        m.z += w * z;
        m.xx += wx * x;
        m.xy += wx * y;
        m.xz += wx * z;
        m.yy += wy * y;
        m.yz += wy * z;
        if (!with_residuals) continue;
        const Lanes e = z * FixedLevelPlane::kUnit - (plane.a * x + plane.b * y + plane.c);
        const Lanes r = floor_lanes(e / FixedLevelPlane::kUnit), square = r * r;
        m.rr += w * (square < kLargestSquare_mm2 ? square : Lanes{} + kLargestSquare_mm2);
      }
    }
    return m;
  }
  BTMS_INLINE void add(const WeightedMoments<Lanes>& part) {
    n += small_integers(part.n);
    x += small_integers(part.x);
    y += small_integers(part.y);
    z += small_integers(part.z);
    xx += small_integers(part.xx);
    xy += small_integers(part.xy);
    xz += small_integers(part.xz);
    yy += small_integers(part.yy);
    yz += small_integers(part.yz);
    rr += small_integers(part.rr);
  }
};

template <class Sum>
BTMS_INLINE WeightedMoments<Sum> weigh(const GatedPoints& p, std::size_t longest, const LanePlane& plane,
                                       const Lanes& steps_per_residual, bool with_residuals) {
  if constexpr (std::is_same_v<Sum, Lanes>) {
    return WeightedMoments<Lanes>::of(p, 0, longest, plane, steps_per_residual, with_residuals);
  } else {
    WeightedMoments<Sum> m;
    for (std::size_t begin = 0; begin < longest; begin += kExactPoints)
      m.add(WeightedMoments<Lanes>::of(p, begin, std::min(begin + kExactPoints, longest), plane, steps_per_residual,
                                       with_residuals));
    return m;
  }
}

// A member of each. Lanes that are put together in memory would have to wait for it.
template <class Member>
BTMS_INLINE Lanes lanes_of(const PlaneStarts& starts, const Member& member) {
  return Lanes{member(starts[0]), member(starts[1]), member(starts[2]), member(starts[3])};
}

// Precondition of Sum = Lanes: no lane has more than kExactPoints.
template <class Sum>
BTMS_INLINE std::array<FittedPlane, kLanes> fit_planes(const GatedPoints& points, const PlaneStarts& starts,
                                                       const PlaneFitRules& rules) {
  const std::size_t longest = points.longest();
  LanePlane plane{lanes_of(starts, [](const PlaneStart& s) { return static_cast<double>(s.plane.a); }),
                  lanes_of(starts, [](const PlaneStart& s) { return static_cast<double>(s.plane.b); }),
                  lanes_of(starts, [](const PlaneStart& s) { return static_cast<double>(s.plane.c); })};
  const Lanes prior_x = lanes_of(starts, [](const PlaneStart& s) { return s.slope_x; });
  const Lanes prior_y = lanes_of(starts, [](const PlaneStart& s) { return s.slope_y; });
  const Lanes steps = weight_steps(lanes_of(starts, [](const PlaneStart& s) { return s.scale_mm; }));
  const Lanes last_steps = weight_steps(lanes_of(starts, [](const PlaneStart& s) { return s.last_scale_mm; }));
  Lanes gx{}, gy{}, mx{}, my{}, mz{}, weight{}, mean_square{};
  LongLanes fitted = LongLanes{} - 1;
  for (int fit = 0; fit < rules.fits; ++fit) {
    const bool last = fit == rules.fits - 1;
    const auto m = weigh<Sum>(points, longest, plane, last ? last_steps : steps, last);
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
    if (last) mean_square = to_lanes(m.rr) / n;
  }
  const Lanes rms = sqrt_lanes(mean_square);
  const auto fitted_lane = [&](std::size_t k) {
    return FittedPlane{fitted[k] != 0, mx[k], my[k], mz[k], gx[k], gy[k], weight[k], rms[k]};
  };
  return {fitted_lane(0), fitted_lane(1), fitted_lane(2), fitted_lane(3)};
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
  return points.longest() <= kExactPoints ? fit_planes<Lanes>(points, starts, rules)
                                          : fit_planes<LongLanes>(points, starts, rules);
}

}  // namespace btms
