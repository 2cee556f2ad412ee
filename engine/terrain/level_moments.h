// Weighted sums over the points of a node: exact integers, so their order does not matter.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/terrain/moments.h"
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

// The points of a node that are not noise, heights from a datum. Memory that is used again for the next node.
class GatedPoints {
 public:
  // Keeps the points on or above the gate. Returns how far the lowest of them is above it, in 2^-12 mm.
  std::int64_t assign(const NodePoints& points, std::int32_t datum_mm, const FixedLevelPlane& gate);
  std::size_t size() const { return size_; }

 private:
  friend struct WeightedMoments;
  std::size_t size_ = 0;
  std::vector<std::int32_t> x_, y_, z_;  // padded to whole lanes by points that weigh nothing
};

inline constexpr int kLevelWeightOne = 256;  // weights are rounded to 1/256, so every sum is an integer

struct WeightedMoments {
  std::int64_t n = 0, x = 0, y = 0, z = 0, xx = 0, xy = 0, xz = 0, yy = 0, yz = 0;
  std::int64_t rr = 0;  // squares of the residuals in mm

  // Points up to the plane weigh 1, above it w = 1 / (1 + (e/s)^4), in steps of s / 64, and nothing from 4 s on.
  static WeightedMoments of(const GatedPoints& points, const FixedLevelPlane& plane, double scale_mm);
  friend bool operator==(const WeightedMoments&, const WeightedMoments&) = default;
};

}  // namespace btms
