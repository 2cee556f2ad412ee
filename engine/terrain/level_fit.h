// One level of the coarse-to-fine method, node by node: fit to the points with the coarser surface as prior, and class.
//
// The prior of a node is a plane: a node lies in exactly one triangle of the level before (or of the surface of the
// round before), so the prior does not bend inside it.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "engine/lattice/plane.h"
#include "engine/terrain/level_node.h"
#include "engine/terrain/level_parameters.h"
#include "engine/terrain/level_planes.h"
#include "engine/terrain/node_model.h"

namespace btms {

// The prior over one node, in the frame of the node's square centre (millimetres).
struct PriorPlane {
  double z = 0;  // height at the square's centre
  double slope_x = 0, slope_y = 0;
  double sd_mm = 0;         // u_P
  std::uint8_t source = 0;  // levels coarser than the node that the prior's height comes from

  double at(double x, double y) const { return z + slope_x * x + slope_y * y; }
  double slope() const { return std::sqrt(slope_x * slope_x + slope_y * slope_y); }  // length of the gradient
};

// Rules of one level with a given resolution.
class LevelRules {
 public:
  LevelRules(const LevelParameters& p, std::int32_t r_mm, bool first, bool last);

  const LevelParameters& p() const { return p_; }
  std::int32_t r_mm() const { return r_mm_; }
  double r_m() const { return r_mm_ / 1000.0; }
  bool first() const { return first_; }
  bool last() const { return last_; }
  // Nodes without points are completed too; elsewhere they keep their prior, which the next level refines anyway.
  bool completes_empty() const { return first_ || last_; }
  std::int32_t completion_halo() const;  // rings a completed node may use

  // Scale of the reweighting where the prior has this slope.
  double fit_scale_m(double slope) const { return fit_scale_m_ + fit_scale_slope_ * r_m() * slope; }
  // Those of the finest level once it is known how the ground scatters.
  LevelRules following(double ground_mm) const;

  // Where the centroid of a triangle is, from its square's centre.
  struct Centroid {
    std::int64_t x3 = 0, y3 = 0;  // in thirds of a millimetre
    double x_mm = 0, y_mm = 0;
    std::int16_t rounded_x_mm = 0, rounded_y_mm = 0;
  };
  const Centroid& centroid(std::uint8_t triangle) const { return centroids_[triangle]; }

 private:
  LevelParameters p_;
  std::int32_t r_mm_;
  bool first_, last_;
  double fit_scale_m_, fit_scale_slope_;
  std::array<Centroid, kTriangles> centroids_;
};

using SquarePoints = std::array<NodePoints, kTriangles>;
using SquarePriors = std::array<PriorPlane, kTriangles>;

// Fits the planes of the four nodes of a square. Depends on the sets of points alone, not on their order. level_class
// becomes kEmpty (like an unfitted node), kThin, or kNear (not yet classified against the prior). Priors are ignored on
// the first level. `gated` is reused memory.
void fit_level_square(const SquarePoints& points, const SquarePriors& priors, const LevelRules& rules,
                      GatedPoints& gated, LevelNode* nodes);
// One of them, as if the others had no points.
LevelNode fit_level_node(const NodePoints& points, std::uint8_t triangle, const PriorPlane& prior,
                         const LevelRules& rules, GatedPoints& gated);

// Near or above the prior, and by how much (steps 4 of the method). Only nodes with a plane change.
void classify(LevelNode& node, const PriorPlane& prior, const LevelRules& rules);

}  // namespace btms
