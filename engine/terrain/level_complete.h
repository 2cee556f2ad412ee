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

// Accepted nodes of a tile, in a frame of the caller's, and those of them that are near a place. Reused memory.
class LevelNeighbourhood {
 public:
  struct Neighbour {  // integers
    double x3, y3;    // in thirds of a millimetre
    double z_mm, slope_x, slope_y, weight;
  };
  struct Square {
    std::uint32_t first = 0, count = 0;
  };

  void clear();
  // The nodes of a square centred at (x, y) that have a plane.
  Square add(const LevelNode* cell, std::int32_t x_mm, std::int32_t y_mm);
  const Neighbour& node(std::uint32_t i) const { return nodes_[i]; }
  // Of all nodes.
  std::int32_t lowest_mm() const { return lowest_mm_; }
  std::int32_t highest_mm() const { return highest_mm_; }

  void choose_none() { chosen_ = 0; }
  void choose(const Square& square);
  // Finds the chosen ones within reach of a place, and some that are a little further. Room for one more than chosen().
  std::size_t find(double x3, double y3, double reach3, std::uint32_t* found) const;
  std::size_t chosen() const { return chosen_; }

 private:
  std::vector<Neighbour> nodes_;  // the first size_ of them
  std::vector<float> x3_, y3_;    // where they are, about
  std::size_t size_ = 0;
  std::int32_t lowest_mm_ = INT32_MAX, highest_mm_ = INT32_MIN;

  static constexpr std::size_t kBlock = 8;    // looked at together
  std::vector<float> chosen_x3_, chosen_y3_;  // the first chosen_ of them, and a block
  std::vector<std::uint32_t> index_;
  std::size_t chosen_ = 0;
};

// What a neighbour says of the four nodes of a square; integers.
struct LevelTerms {
  double k[kLanes];  // kernel times weight, 2^-24
  double z[kLanes];  // height it proposes, mm, from the datum
};
struct LevelCompletionScratch {
  std::vector<std::uint32_t> found;
  std::vector<LevelTerms> terms;
};

// Completes the wanted nodes of a square that is centred at (centre_x, centre_y) in the frame of `near`, a lane each,
// from the nodes chosen there. Without any in reach a node takes the prior as it is; on the first level it becomes
// kOutside then.
void complete_level_square(LevelNode* nodes, const std::array<bool, kTriangles>& wanted, std::int32_t centre_x_mm,
                           std::int32_t centre_y_mm, const LevelNeighbourhood& near, const SquarePriors& priors,
                           const LevelRules& rules, LevelCompletionScratch& scratch);

// A node without points: the prior as it is, with the least weight.
void take_prior(LevelNode& node, std::uint8_t t, const PriorPlane& prior, const LevelRules& rules);

}  // namespace btms
