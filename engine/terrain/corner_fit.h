// Traversability-aware global terrain model fitting (paper II-C): heights of the tri-grid's corners from the planes
// around them (the weighted corner fitting of the paper's predecessor), and each node's final plane from its three
// corners (Eq 12-13).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "engine/lattice/coordinates.h"
#include "engine/lattice/plane.h"
#include "engine/terrain/node.h"

namespace btms {

// The plane of an n^t, ready to be asked for heights at the corners of its square.
struct CornerPlane {
  double mean_x, mean_y, mean_z, slope_x, slope_y, weight;

  explicit CornerPlane(const Node& node)
      : mean_x(node.mean_x_mm), mean_y(node.mean_y_mm), mean_z(node.mean_z_mm), weight(node.weight) {
    const Eigen::Vector2d g = gradient_of(node);
    slope_x = g.x();
    slope_y = g.y();
  }
};

// Weighted mean of the planes of the n^t around one corner. Add them in ascending order of their nodes: the sums are
// floating point.
class CornerMean {
 public:
  // The corner lies at (x, y) from the centre of the plane's square, millimetres.
  void add(const CornerPlane& plane, double corner_x_mm, double corner_y_mm) {
    const double x = corner_x_mm - plane.mean_x, y = corner_y_mm - plane.mean_y;  // the corner seen from m_i
    const double z = plane.mean_z + plane.slope_x * x + plane.slope_y * y;
    const double w = plane.weight / std::max(1.0, std::sqrt(x * x + y * y));  // distance floored at 1 mm
    weighted_ += w * z;
    weight_ += w;
    plain_ += z;
    ++count_;
  }
  // Millimetres, or kUnknownHeight_mm where no n^t touches the corner.
  std::int32_t height_mm() const {
    if (count_ == 0) return kUnknownHeight_mm;
    const double z = weight_ > 0 ? weighted_ / weight_ : plain_ / count_;
    return btms::height_mm(z);
  }

 private:
  double weighted_ = 0, weight_ = 0, plain_ = 0;
  int count_ = 0;
};

}  // namespace btms
