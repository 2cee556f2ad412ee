// A finished piece of the terrain model: what is stored, served, queried and labelled against.
//
// All stored values are integers, so a tile has the same bits whoever computed it. The surface is continuous and
// piecewise linear: every node (triangle) spans its centre corner and two lattice corners (paper Eq 12-13). A node has
// a final plane exactly when its state is not kUnknown; then its three corner heights are known.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/lattice/lattice.h"
#include "engine/lattice/plane.h"
#include "engine/lattice/tiles.h"

namespace btms {

enum class NodeState : std::uint8_t {
  kUnknown = 0,    // no final plane here; every field but the count of points has its default
  kObserved = 1,   // terrain seen here
  kPredicted = 2,  // terrain inferred from its surroundings; nothing seen here contradicts it
  kObstacle = 3,   // terrain inferred below something that stands here
  kFilled = 4,     // far from any terrain seen: a guess that keeps the surface whole (see source_level)
};

inline constexpr std::uint16_t kNothingAbove = 65535;  // clearance: nothing was seen above
inline constexpr std::uint8_t kNotTraversable = 255;   // cost

// One stored node, 18 bytes. Lengths saturate.
struct NodeSurface {
  NodeState state = NodeState::kUnknown;
  std::uint8_t weight = 0;       // traversability weight (Eq 3 or 11) in 1/255
  std::uint16_t count = 0;       // points in the node, 65535 = that many or more
  std::uint16_t support = 0;     // sum of kernel values behind a prediction in 1/256, saturating; 0 where observed
  std::uint16_t sd_mm = 0;       // standard deviation of the height: the truth is within 1.96 sd 95 times in 100
  std::uint16_t terrain_mm = 0;  // points up to this far above the surface, vertically, are terrain
  // Layers on the finished surface; step and cost as traversability.h defines them
  std::uint16_t roughness_mm = 0;              // rms distance of the node's terrain points from the surface
  std::uint16_t step_mm = 0;                   // jump in height of the ground across it
  std::uint16_t clearance_mm = kNothingAbove;  // up to the lowest thing seen above it, saturating at 65534
  std::uint8_t cost = kNotTraversable;         // of crossing it with the described vehicle: 0 free .. 254
  std::uint8_t source_level = 0;               // levels coarser than the finest that the height comes from
  friend bool operator==(const NodeSurface&, const NodeSurface&) = default;
};

enum class UpperKind : std::uint8_t {
  kReachable = 1,  // joins the terrain somewhere: bridge deck, ramp, gallery floor
  kDetached = 2,   // roof, ceiling, or a deck whose ends lie outside the map
};

// A plane of another surface over a node: a bridge deck above a road, a gallery, a ceiling. 20 bytes.
struct UpperNode {
  std::uint32_t node = 0;                 // node_index() in the tile
  std::int32_t z_mm = 0;                  // height over the centre of the node's square
  std::int16_t slope_x = 0, slope_y = 0;  // 2^-13
  std::uint16_t sd_mm = 0;                // spread of the points about it, saturating
  std::uint16_t count = 0;                // points, saturating
  UpperKind kind = UpperKind::kDetached;
  friend bool operator==(const UpperNode&, const UpperNode&) = default;
};

// Value type; not synchronised. Rows run from south to north (ascending y).
struct TerrainTile {
  std::int32_t resolution_mm = 0;
  CellBox box;                          // the cells held; the tile's own box cropped to where there is anything
  std::vector<std::int32_t> corner_mm;  // heights, (rows + 1) x (cols + 1), lattice corner A of cell (row, col) first
  std::vector<std::int32_t> centre_mm;  // heights, rows x cols
  std::vector<NodeSurface> nodes;       // rows x cols x 4
  std::vector<UpperNode> upper;         // further surfaces, ascending by (node, z_mm)

  TerrainTile() = default;
  // Everything unknown.
  TerrainTile(std::int32_t r_mm, const CellBox& b)
      : resolution_mm(r_mm),
        box(b),
        corner_mm(static_cast<std::size_t>((b.rows() + 1) * (b.cols() + 1)), kUnknownHeight_mm),
        centre_mm(static_cast<std::size_t>(b.cells()), kUnknownHeight_mm),
        nodes(static_cast<std::size_t>(b.cells() * kTriangles)) {}

  template <class Fn>
  void for_each_buffer(const Fn& fn) {
    fn(corner_mm), fn(centre_mm), fn(nodes), fn(upper);
  }
  std::size_t cell_index(Cell c) const {
    return static_cast<std::size_t>((std::int64_t{c.row} - box.row0) * box.cols() + (c.col - box.col0));
  }
  std::size_t node_index(NodeId n) const { return cell_index(n.cell) * kTriangles + n.triangle; }
  // Index of the lattice corner A (south-west) of a cell; cells one past the box's end are valid here.
  std::size_t corner_index(Cell c) const {
    return static_cast<std::size_t>((std::int64_t{c.row} - box.row0) * (box.cols() + 1) + (c.col - box.col0));
  }
  // Heights of a node's corners in the order of triangle_corners(): centre, then counter-clockwise.
  std::array<std::int32_t, 3> corners_mm(NodeId n) const {
    const auto rel = triangle_corners(n.triangle);
    const auto at = [&](HalfCell h) { return corner_mm[corner_index({n.cell.col + h.x / 2, n.cell.row + h.y / 2})]; };
    return {centre_mm[cell_index(n.cell)], at(rel[1]), at(rel[2])};
  }
};

}  // namespace btms
