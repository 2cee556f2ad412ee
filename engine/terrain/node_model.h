// From the points of a node to its plane, weight and class (paper Eq 2, 3, 5).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/terrain/node.h"
#include "engine/terrain/parameters.h"

namespace btms {

// Parameters of the node model as the integers it computes with.
struct NodeModelRules {
  NodeModel model = NodeModel::kRobust;
  NodeWeight weight = NodeWeight::kNormalized;
  double weight_unit = 1;  // predecessor: what a stored weight of 1 stands for, 4 r^4
  std::int32_t seed_height_mm = 0;
  std::int32_t refit_distance_mm = 0;
  std::int32_t steepest_normal_xy2 = 0;  // sin^2(theta) in 2^-30: Eq 5 on the stored normal
  std::uint32_t min_points = 0;          // sigma

  explicit NodeModelRules(const Parameters& p);
};

// sin^2 of a slope in 2^-30, the integer that stored normals are compared with.
std::int32_t steepest_normal_xy2(double slope_max_deg);

// Points of one node as structure of arrays: x, y from the square's centre, z absolute; millimetres.
struct NodePoints {
  const std::int16_t* x_mm = nullptr;
  const std::int16_t* y_mm = nullptr;
  const std::int32_t* z_mm = nullptr;
  std::size_t size = 0;
};

using FourPoints = std::array<NodePoints, 4>;
// Reusable memory of model_four().
struct ModelScratch {
  std::vector<double> x_mm, y_mm, z_mm;  // the points of four nodes, side by side
};

// Four nodes from their points: kEmpty without points, kNoPlane or kCandidate with. The result depends on the sets of
// points, not on their order. Thread-safe with a scratch each; total for up to kMaxNodePoints points a node.
void model_four(const FourPoints& points, const NodeModelRules& rules, ModelScratch& scratch, Node* four);

}  // namespace btms
