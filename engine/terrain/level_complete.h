// Completion of a level (step 7): a node that is not terrain takes its height from the terrain around it, as a
// difference to its prior; its slope is the prior's.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/terrain/level_fit.h"
#include "engine/terrain/level_node.h"

namespace btms {

// Accepted nodes near a place, in a frame of the caller's.
struct LevelNeighbourhood {
  std::vector<std::int32_t> x_mm, y_mm, z_mm;
  std::vector<std::int16_t> slope_x, slope_y;
  std::vector<std::uint16_t> weight;

  void clear();
  void add(const LevelNode& node, std::int32_t x, std::int32_t y);
  std::size_t size() const { return x_mm.size(); }
};

struct LevelTerm {
  std::int64_t k;  // kernel times weight, 2^-24
  std::int64_t z;  // height it proposes, mm, from the datum
};

// Completes the node of triangle t whose square is centred at (centre_x, centre_y) in the frame of `near`. Without any
// neighbour in reach it takes the prior as it is; on the first level it becomes kOutside then. `terms` is reused
// memory.
void complete_level_node(LevelNode& node, std::uint8_t t, std::int32_t centre_x_mm, std::int32_t centre_y_mm,
                         const LevelNeighbourhood& near, const PriorPlane& prior, const LevelRules& rules,
                         std::vector<LevelTerm>& terms);

// A node without points: the prior as it is, with the least weight.
void take_prior(LevelNode& node, std::uint8_t t, const PriorPlane& prior, const LevelRules& rules);

}  // namespace btms
