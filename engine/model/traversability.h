// What a vehicle meets on the finished surface. Integers, and doubles element by element: the same bits everywhere.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/lattice/neighbours.h"
#include "engine/lattice/plane.h"
#include "engine/model/terrain_tile.h"
#include "engine/terrain/parameters.h"

namespace btms {

// Heights of a node's corners in the order of triangle_corners(); all unknown where it has no surface.
struct NodeCorners {
  std::array<std::int32_t, 3> mm = {kUnknownHeight_mm, kUnknownHeight_mm, kUnknownHeight_mm};
  bool known() const { return mm[0] != kUnknownHeight_mm; }
};

// The step across a node, to the centimetre (less is noise), saturating. The surface has no jumps: a wall comes out as
// a steep node between flatter ones. Of the corners of the nodes around, those at its foot then lie above the node's
// own plane and those on its top below it. A slope that goes on, a crest and a valley floor leave all on one side, and
// are no step. The smaller of the two greatest distances, doubled and at most the range of the heights looked at, is
// the height of the wall. What is shorter than two squares looks like a wall, ramps too. `around` are the neighbours in
// the order of kNeighbourTable. Precondition: own.known().
std::uint16_t step_mm(std::uint8_t triangle, const NodeCorners& own,
                      const std::array<const NodeCorners*, kNeighbours>& around);

// The heights around a row of squares, south to north, each row from one column west of the first square on: lattice
// corners A of the squares in the rows -1 to 2, centre corners in the rows -1 to 1. All known, and less than
// kMostStepRelief_mm apart.
struct HeightRows {
  std::array<const std::int32_t*, 4> corner_mm;
  std::array<const std::int32_t*, 3> centre_mm;
};
inline constexpr std::int32_t kMostStepRelief_mm = 1 << 24;

// step_mm() of one triangle of every square of a row, many at a time. An object a worker: memory that is used again.
class StepRow {
 public:
  std::span<const std::uint16_t> of(std::uint8_t triangle, const HeightRows& rows, std::size_t squares);

 private:
  struct Columns {
    std::vector<std::int32_t> centre_mm, rise_x_mm, rise_y_mm, above2_mm, below2_mm, low_mm, high_mm;
  };
  Columns columns_;
  std::vector<std::uint16_t> steps_mm_;
};

// The vehicle of the parameters.
class Vehicle {
 public:
  explicit Vehicle(const Parameters& p);

  // Of crossing the node, by itself: the worst of slope, step and twice the roughness, each a share of its limit (the
  // step's for roughness, which never exceeds it). Not traversable: over a limit of slope, step or clearance, obstacle,
  // filled, unknown.
  std::uint8_t cost(const NodeSurface& node, const FinalPlane& plane) const;

  // The nodes within half the vehicle's width of the centroid of a triangle, itself among them.
  const std::vector<NodeOffset>& footprint(std::uint8_t triangle) const { return footprint_[triangle]; }
  // How many squares away they are at most.
  std::int32_t rings() const { return rings_; }

 private:
  double steepest_rise_mm_;  // over one r
  double highest_step_mm_, height_mm_;
  std::int32_t rings_ = 0;
  std::array<std::vector<NodeOffset>, kTriangles> footprint_;
};

}  // namespace btms
