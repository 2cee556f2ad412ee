// Corners of a level (step 8): weighted means of the planes around them, a row of corners at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/lattice/lattice.h"
#include "engine/terrain/level_fit.h"
#include "engine/terrain/level_node.h"

namespace btms {

// Height and uncertainty at a corner; integers, like everything that is handed on.
struct LevelCorner {
  std::int32_t z_mm = kUnknownHeight_mm;
  std::uint16_t sd_mm = 0;
  std::uint16_t disagreement_mm = 0;  // how far the planes around the corner disagree about it
};

// Planes of the nodes of a row of squares as lanes want them. Memory that is used again.
class PlaneRow {
 public:
  // `squares`: four nodes each. Those outside the map weigh nothing.
  void assign(std::span<const LevelNode> squares);

 private:
  friend class CornerRules;
  struct Planes {  // of one triangle
    std::vector<double> x_mm, y_mm, z_mm, slope_x, slope_y, weight, sd_mm;
  };
  std::array<Planes, kTriangles> planes_;
};

class CornerRules {
 public:
  explicit CornerRules(const LevelRules& rules);
  // The corners between two rows of squares: the n-th is the north-east one of the n-th square of `south`.
  void corners(const PlaneRow& south, const PlaneRow& north, std::span<LevelCorner> out) const;
  // The centres of a row, from its second square on.
  void centres(const PlaneRow& row, std::span<LevelCorner> out) const;

 private:
  double r_mm_, half_mm_, floor_mm_;
};

}  // namespace btms
