// What the points of a node say about the space over its finished surface: how rough the terrain is, how high the
// lowest thing above it hangs, and which further surfaces (a deck, a roof, a ceiling, a road below) there are.
//
// Pure and thread-safe; depends on the set of points alone, not on their order.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/lattice/plane.h"
#include "engine/terrain/level_fit.h"
#include "engine/terrain/node_model.h"

namespace btms {

inline constexpr std::int32_t kNoneAbove = INT32_MAX;

// What one look at a node's points over its finished surface says.
struct NodeLook {
  std::uint16_t roughness_mm = 0;          // rms height of the points within terrain_mm of the surface, above or below
  std::int32_t clearance_mm = kNoneAbove;  // height of the lowest point further above. A single one is enough: a
                                           // planner would rather walk round a speck of noise than into a wire.
  std::uint32_t off = 0;                   // points further above, and further below than room_mm
};

// Also stores the heights of the points over the surface, vertically, nearest millimetre; `heights` has room for all.
NodeLook look_over(const NodePoints& points, const FinalPlane& surface, std::int32_t r_mm, std::int32_t terrain_mm,
                   std::int32_t room_mm, std::int32_t* heights);

// A sheet: a plane with free space above and below it. `above_mm` is its height over the surface at the node's mean.
struct NodeSheet {
  LevelNode plane;
  std::int32_t above_mm = 0;
};

// A node's points over its finished surface. The default: no points, or no surface to be above.
struct PointsOverSurface {
  NodePoints points;
  const std::int32_t* heights_mm = nullptr;  // over `surface`, as look_over() stores them
  FinalPlane surface;
  std::int32_t terrain_mm = 0;
  std::uint32_t off = 0;
};

// Finds the sheets of the four nodes of a square. Points above the terrain (or far below it) are split where there is a
// gap; each group is fitted the way terrain is, to its lowest points with the surface's slope as prior, and is a sheet
// when most of what lies within upper_gap_m of the plane lies on it: in a tree nothing does. A few points are enough
// for a sheet, but not for a surface; that takes a whole component (tiling/above_pass.cpp). Memory that is used again
// for the next square.
class SheetFinder {
 public:
  explicit SheetFinder(const LevelRules& rules);
  // The free space that makes two surfaces of one.
  std::int32_t room_mm() const { return room_mm_; }

  using Square = std::array<PointsOverSurface, kTriangles>;
  void find(const Square& square);
  // Of a node of the square, ascending.
  std::span<const NodeSheet> sheets(std::uint8_t triangle) const { return nodes_[triangle].sheets; }

 private:
  struct Group {
    std::size_t from, to;
    std::int32_t lowest_mm;  // over the surface
  };
  struct Node {
    std::vector<std::int16_t> x_mm, y_mm;  // what is off the surface, group by group
    std::vector<std::int32_t> z_mm;
    std::vector<Group> groups;  // that may be sheets, ascending
    std::vector<NodeSheet> sheets;
  };
  void split(const PointsOverSurface& node, Node& out);
  void split_sorted(std::size_t n, std::vector<Group>& groups);
  void keep(const PointsOverSurface& node, LevelNode plane, std::vector<NodeSheet>& sheets) const;

  LevelRules rules_;
  std::int32_t room_mm_, split_mm_;
  std::array<Node, kTriangles> nodes_;
  std::vector<std::int64_t> order_;  // height and index in one word
  GatedPoints gated_;
};

// The surface itself as the links see it: the plane at the node's centroid.
LevelNode surface_node(std::uint8_t triangle, const FinalPlane& surface, std::int32_t r_mm);

// The height over the centre of the node's square.
std::int32_t height_at_centre_mm(const LevelNode& plane);

}  // namespace btms
