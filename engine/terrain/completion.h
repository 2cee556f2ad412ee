// BGK-based terrain model completion (paper II-B, Eq 7-11): predicts the model of a node from the observed terrain
// nodes around it. Predictions never feed predictions.
//
// Every sum below runs over integers (kernel values in 2^-24 or coarser, heights and offsets in millimetres, normals
// and weights as stored), so the result does not depend on the order of the neighbours. They are summed in doubles
// where that is exact, as nearly everywhere, else in 63 bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/terrain/node.h"
#include "engine/terrain/parameters.h"

namespace btms {

struct CompletionRules {
  Completion completion = Completion::kKernel;  // kNone: predict nothing
  CompletionNormals normals = CompletionNormals::kPlane;
  std::int64_t reach9_mm2 = 0;   // 9 l^2: squared distances are exact in thirds of a millimetre
  double radius_mm = 0;          // l
  double per_third_mm = 0;       // 1 / 3 l: from thirds of a millimetre to d/l
  double square_reach_mm2 = 0;   // around a square's centre: what its four centroids can reach lies within, squared
  double ridge_mm2 = 0;          // plane normals: (r/2)^2, how strongly the neighbours' own slopes count
  std::int64_t min_support = 0;  // in 2^-24
  std::int32_t steepest_normal_xy2 = 0;
  std::int32_t resolution_mm = 0;
  std::int32_t standing_mm = 0;  // points this far above a prediction stand on it
  int moment_bits = 0;           // kernel values in second moments: as fine as 63 bits allow for this l

  explicit CompletionRules(const Parameters& p);
  // Rings of cells around a tile whose nodes a prediction may use: ceil(l/r - 1/6), since a centroid lies at least r/6
  // inside its square.
  std::int32_t halo() const;
};

// An observed terrain node as predictions read it. Positions are relative to a frame of the caller's (a tile), in
// millimetres; all values are integers.
struct Neighbour {
  double x_mm, y_mm, z_mm;
  double normal_x, normal_y, normal_z;  // 2^-15
  double slope_x, slope_y;              // 2^-12
  double weight;                        // 2^-16
};
Neighbour neighbour_of(const Node& node, std::int32_t x_mm, std::int32_t y_mm);

// Reusable memory of predict_square().
struct CompletionScratch {
  std::vector<std::uint32_t> index;  // of the neighbours within reach
  std::vector<double> terms;         // these neighbours, structure of arrays
};

// Predicts those of a square's four nodes that are not kTerrain; the square is centred at (centre_x, centre_y) in the
// frame of `terrain`. `near` names the neighbours, which may be more than lie within the kernel. Where a prediction
// holds, the node becomes kPredicted with mean at its centroid; otherwise it keeps its class. Support and spread are
// stored either way.
void predict_square(Node* square, std::int32_t centre_x_mm, std::int32_t centre_y_mm,
                    std::span<const Neighbour> terrain, std::span<const std::uint32_t> near,
                    const CompletionRules& rules, CompletionScratch& scratch);

}  // namespace btms
