#include "engine/terrain/level_moments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "engine/wide.h"

namespace btms {
namespace {

constexpr int kWeightSteps = 256;  // residuals up to 4 s in this many steps
constexpr double kCutOff = 4;

// By e/s; beyond the last step nothing is left.
constexpr std::array<double, kWeightSteps + 1> weight_table() {
  std::array<double, kWeightSteps + 1> table{};
  for (int i = 0; i < kWeightSteps; ++i) {
    const double q = (i + 0.5) * kCutOff / kWeightSteps, q2 = q * q;
    table[i] = static_cast<std::int32_t>(kLevelWeightOne / (1 + q2 * q2) + 0.5);
  }
  return table;
}
constexpr auto kWeights = weight_table();
static_assert(kWeights.front() == kLevelWeightOne && kWeights.back() == 0);

// Four doubles that hold integers: below 2^53 they add and multiply exactly.
using Lanes = double __attribute__((vector_size(32)));
using IntLanes = std::int32_t __attribute__((vector_size(16)));
constexpr std::size_t kLanes = sizeof(Lanes) / sizeof(double);
constexpr std::int32_t kPadding_mm = 1 << 30;  // a height far above any plane

// A weight, two coordinates of 15 bits or one and a height of 18, or the square of a residual: 2^41, so many times.
constexpr std::size_t kExactPoints = 1 << 12;
constexpr double kLargestSquare_mm2 = 1 << 30;

}  // namespace

std::int64_t GatedPoints::assign(const NodePoints& p, std::int32_t datum_mm, const FixedLevelPlane& gate) {
  if (x_.size() < p.size + kLanes) {
    x_.resize(p.size + kLanes);
    y_.resize(p.size + kLanes);
    z_.resize(p.size + kLanes);
  }
  std::int64_t lowest = INT64_MAX;
  std::size_t n = 0;
  for (std::size_t i = 0; i < p.size; ++i) {
    const std::int64_t z =
        std::clamp<std::int64_t>(std::int64_t{p.z_mm[i]} - datum_mm, -kMaxNodeRelief_mm, kMaxNodeRelief_mm);
    const std::int64_t above = gate.above(p.x_mm[i], p.y_mm[i], z);
    x_[n] = p.x_mm[i];
    y_[n] = p.y_mm[i];
    z_[n] = static_cast<std::int32_t>(z);
    n += above >= 0;
    lowest = std::min(lowest, above >= 0 ? above : INT64_MAX);
  }
  size_ = n;
  for (std::size_t i = n; i < n + kLanes; ++i) x_[i] = y_[i] = 0, z_[i] = kPadding_mm;
  return lowest;
}

BTMS_WIDE WeightedMoments WeightedMoments::of(const GatedPoints& p, const FixedLevelPlane& plane, double scale_mm) {
  WeightedMoments m;
  // Steps per 2^-12 mm of residual, in 2^-32.
  const double per_residual =
      std::floor(kWeightSteps / (kCutOff * scale_mm * FixedLevelPlane::kUnit) * 4294967296.0 + 0.5) / 4294967296.0;
  const auto a = static_cast<double>(plane.a), b = static_cast<double>(plane.b), c = static_cast<double>(plane.c);
  for (std::size_t begin = 0; begin < p.size_; begin += kExactPoints) {
    const std::size_t end = std::min(begin + kExactPoints, p.size_);
    Lanes n{}, sx{}, sy{}, sz{}, xx{}, xy{}, xz{}, yy{}, yz{}, rr{};
    for (std::size_t i = begin; i < end; i += kLanes) {
      IntLanes ix, iy, iz;
      std::memcpy(&ix, p.x_.data() + i, sizeof ix);
      std::memcpy(&iy, p.y_.data() + i, sizeof iy);
      std::memcpy(&iz, p.z_.data() + i, sizeof iz);
      const Lanes x = __builtin_convertvector(ix, Lanes), y = __builtin_convertvector(iy, Lanes),
                  z = __builtin_convertvector(iz, Lanes);
      const Lanes e = z * FixedLevelPlane::kUnit - (a * x + b * y + c);
      Lanes step = e * per_residual;
      step = step > 0.0 ? step : Lanes{};
      step = step < double{kWeightSteps} ? step : Lanes{} + double{kWeightSteps};
      const IntLanes k = __builtin_convertvector(step, IntLanes);
      const Lanes w{kWeights[k[0]], kWeights[k[1]], kWeights[k[2]], kWeights[k[3]]};
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
      const Lanes exact = e / FixedLevelPlane::kUnit;
      Lanes r = __builtin_convertvector(__builtin_convertvector(exact, IntLanes), Lanes);
      r = r > exact ? r - 1.0 : r;  // down, below zero too
      const Lanes square = r * r;
      rr += w * (square < kLargestSquare_mm2 ? square : Lanes{} + kLargestSquare_mm2);
    }
    const auto total = [](const Lanes& v) __attribute__((always_inline)) {
      return static_cast<std::int64_t>((v[0] + v[1]) + (v[2] + v[3]));
    };
    m.n += total(n);
    m.x += total(sx);
    m.y += total(sy);
    m.z += total(sz);
    m.xx += total(xx);
    m.xy += total(xy);
    m.xz += total(xz);
    m.yy += total(yy);
    m.yz += total(yz);
    m.rr += total(rr);
  }
  return m;
}

}  // namespace btms
