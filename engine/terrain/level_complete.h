// Completion of a level (step 7): a node that is not terrain takes its height from the terrain around it, as a
// difference to its prior; its slope is the prior's.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/lattice/lanes.h"
#include "engine/terrain/level_fit.h"
#include "engine/terrain/level_node.h"

namespace btms {

// Accepted nodes near a place, in a frame of the caller's. Reused memory.
class LevelNeighbourhood {
 public:
  void clear();
  // The nodes of a square centred at (x, y) that have a plane.
  void add(const LevelNode* cell, std::int32_t x_mm, std::int32_t y_mm);

  struct Neighbour {  // integers
    double x3, y3;    // in thirds of a millimetre
    double z_mm, slope_x, slope_y, weight;
  };
  std::span<const Neighbour> nodes() const { return {nodes_.data(), size_}; }
  std::int32_t lowest_mm() const { return lowest_mm_; }
  std::int32_t highest_mm() const { return highest_mm_; }

 private:
  std::vector<Neighbour> nodes_;  // the first size_ of them
  std::size_t size_ = 0;
  std::int32_t lowest_mm_ = INT32_MAX, highest_mm_ = INT32_MIN;
};

// What a neighbour says of the four nodes of a square; integers.
struct LevelTerms {
  const LevelNeighbourhood::Neighbour* from;
  double k[kLanes];  // kernel times weight, 2^-24
  double z[kLanes];  // height it proposes, mm, from the datum
};

// Completes the wanted nodes of a square that is centred at (centre_x, centre_y) in the frame of `near`, a lane each.
// Without any neighbour in reach a node takes the prior as it is; on the first level it becomes kOutside then. `terms`
// is reused memory.
void complete_level_square(LevelNode* nodes, const std::array<bool, kTriangles>& wanted, std::int32_t centre_x_mm,
                           std::int32_t centre_y_mm, const LevelNeighbourhood& near, const SquarePriors& priors,
                           const LevelRules& rules, std::vector<LevelTerms>& terms);

// A node without points: the prior as it is, with the least weight.
void take_prior(LevelNode& node, std::uint8_t t, const PriorPlane& prior, const LevelRules& rules);

}  // namespace btms
