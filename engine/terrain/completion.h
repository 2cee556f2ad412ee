// BGK-based terrain model completion (paper II-B, Eq 7-11): predicts the model of a node from the observed terrain
// nodes around it. Predictions never feed predictions.
//
// Every sum below runs over integers that fit 63 bits (kernel values in 2^-24 or coarser, heights and offsets in
// millimetres, normals and weights as stored), so the result does not depend on the order of the neighbours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/terrain/node.h"
#include "engine/terrain/parameters.h"

namespace btms {

struct CompletionRules {
  CompletionNormals normals = CompletionNormals::kPlane;
  std::int64_t reach9_mm2 = 0;   // 9 l^2: squared distances are exact in thirds of a millimetre
  double radius_mm = 0;          // l
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

// Observed terrain nodes near a place, structure of arrays. Positions are relative to a frame of the caller's (a tile).
struct Neighbourhood {
  std::vector<std::int32_t> x_mm, y_mm, z_mm;
  std::vector<std::int32_t> normal_x, normal_y, normal_z;  // 2^-15
  std::vector<std::int32_t> slope_x, slope_y;              // 2^-12
  std::vector<std::uint16_t> weight;

  void clear();
  void add(const Node& node, std::int32_t x, std::int32_t y);
  std::size_t size() const { return x_mm.size(); }
};

// Reusable memory of predict().
struct CompletionScratch {
  struct Term {
    std::int64_t k;  // 2^-24
    std::uint32_t index;
  };
  std::vector<Term> terms;
};

// Predicts the node of triangle `t` whose square is centred at (centre_x, centre_y) in the frame of `near`, which may
// hold more nodes than lie within the kernel. Where the prediction holds, the node becomes kPredicted with mean at its
// centroid; otherwise it keeps its class. Support and spread are stored either way.
void predict(Node& node, std::uint8_t t, std::int32_t centre_x_mm, std::int32_t centre_y_mm, const Neighbourhood& near,
             const CompletionRules& rules, CompletionScratch& scratch);

}  // namespace btms
