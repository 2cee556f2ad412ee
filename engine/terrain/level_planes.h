// Reweighted least squares on the points of a square: the planes of its four nodes at once, a lane each.
//
// Sums are exact integers, so the order of the points does not matter; the rest is element by element.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/lattice/lattice.h"
#include "engine/terrain/node.h"
#include "engine/terrain/node_model.h"

namespace btms {

// z = (a x + b y + c) / 2^12, millimetres from the square's centre; z from a datum.
struct FixedLevelPlane {
  static constexpr int kBits = 12;
  static constexpr double kUnit = 1 << kBits;
  std::int64_t a = 0, b = 0, c = 0;

  static FixedLevelPlane of(double slope_x, double slope_y, double z) {
    return {static_cast<std::int64_t>(round_half_up(slope_x * kUnit)),
            static_cast<std::int64_t>(round_half_up(slope_y * kUnit)),
            static_cast<std::int64_t>(round_half_up(z * kUnit))};
  }
  std::int64_t above(std::int64_t x, std::int64_t y, std::int64_t z) const {  // in 2^-12 mm
    return (z << kBits) - (a * x + b * y + c);
  }
};

// The points of the nodes of a square that are not noise. Memory that is used again for the next square.
class GatedPoints {
 public:
  void clear() { size_ = {}; }
  // Keeps the points on or above the gate, heights from the datum. Returns how far the lowest of them is above it, in
  // 2^-12 mm.
  std::int64_t assign(std::size_t lane, const NodePoints& points, std::int32_t datum_mm, const FixedLevelPlane& gate);
  std::size_t size(std::size_t lane) const { return size_[lane]; }
  std::size_t longest() const;
  // Fills shorter lanes with points that weigh nothing, up to the longest.
  void pad();

  static constexpr std::size_t kLanes = kTriangles;
  const double* x_mm() const { return x_.data(); }  // integers; point i of lane k at i kLanes + k
  const double* y_mm() const { return y_.data(); }
  const double* z_mm() const { return z_.data(); }

 private:
  std::array<std::size_t, kLanes> size_{};
  std::vector<double> x_, y_, z_;
};

struct PlaneFitRules {
  int fits = 0;
  double ridge_mm2 = 0;           // pull towards the prior's slope
  bool ridge_per_weight = false;  // divided by the sum of weights
  double least_weight = 0;        // a fit with less ends without a plane
};

// Where the fit of a lane starts, the slope it is pulled to, and the scale s of its weights.
struct PlaneStart {
  FixedLevelPlane plane;
  double slope_x = 0, slope_y = 0;
  double scale_mm = 1, last_scale_mm = 1;  // the latter in the last fit
};

// Weighted mean from the square's centre and the datum, slopes, sum of weights, rms residual.
struct FittedPlane {
  bool fitted = false;
  double x_mm = 0, y_mm = 0, z_mm = 0, slope_x = 0, slope_y = 0, weight = 0, rms_mm = 0;
};

// Points up to the plane of the fit before weigh 1, above it w = 1 / (1 + (e/s)^4) in steps of s / 64, rounded to
// 1/256, and nothing from 4 s on.
using PlaneStarts = std::array<PlaneStart, GatedPoints::kLanes>;
std::array<FittedPlane, GatedPoints::kLanes> fit_planes(const GatedPoints& points, const PlaneStarts& starts,
                                                        const PlaneFitRules& rules);

}  // namespace btms
