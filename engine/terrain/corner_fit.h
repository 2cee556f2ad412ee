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

// Weighted mean of the planes of the n^t around one corner. Add the incident nodes in the fixed order of kIncidentTable
// (lattice corners) or by triangle (centre corners): the sums are floating point.
class CornerMean {
 public:
  // The node's square is centred at (dx, dy) from the corner, millimetres.
  void add(const Node& node, std::int32_t dx_mm, std::int32_t dy_mm) {
    if (!node.is_terrain()) return;
    const double x = -(dx_mm + node.mean_x_mm), y = -(dy_mm + node.mean_y_mm);  // the corner seen from m_i
    const Eigen::Vector2d g = gradient_of(node);
    const double z = node.mean_z_mm + g.x() * x + g.y() * y;
    const double w = node.weight / std::max(1.0, std::sqrt(x * x + y * y));  // distance floored at 1 mm
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
