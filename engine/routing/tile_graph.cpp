#include "engine/routing/tile_graph.h"

#include <algorithm>
#include <cmath>

#include "engine/lattice/coordinates.h"

namespace btms {
namespace {

// Places in sixths of r, so that all corners and centroids are integers.
struct Sixths {
  int x = 0, y = 0;
};

constexpr Sixths centroid(NodeOffset o) {
  constexpr Sixths kFromCentre[kTriangles] = {{2, 0}, {0, 2}, {-2, 0}, {0, -2}};
  return {6 * o.col + 3 + kFromCentre[o.triangle].x, 6 * o.row + 3 + kFromCentre[o.triangle].y};
}

constexpr int cross(Sixths o, Sixths a, Sixths b) { return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x); }

// Whether a segment and a triangle share a point: none of the triangle's edges nor the segment parts them.
constexpr bool touches(Sixths a, Sixths b, NodeOffset o) {
  std::array<Sixths, 3> t{};
  for (std::size_t i = 0; i < 3; ++i) {
    const HalfCell h = triangle_corners(o.triangle)[i];
    t[i] = {6 * o.col + 3 * h.x, 6 * o.row + 3 * h.y};
  }
  for (std::size_t i = 0; i < 3; ++i)
    if (cross(t[i], t[(i + 1) % 3], a) < 0 && cross(t[i], t[(i + 1) % 3], b) < 0) return false;
  const int s0 = cross(a, b, t[0]), s1 = cross(a, b, t[1]), s2 = cross(a, b, t[2]);
  return !((s0 > 0 && s1 > 0 && s2 > 0) || (s0 < 0 && s1 < 0 && s2 < 0));
}

// What the line between two neighbours' centroids touches besides them.
struct Between {
  std::array<NodeOffset, 6> offset{};
  int count = 0;
};
constexpr auto kBetween = [] {
  std::array<std::array<Between, kNeighbours>, kTriangles> table{};
  for (std::uint8_t t = 0; t < kTriangles; ++t)
    for (std::size_t n = 0; n < kNeighbours; ++n) {
      const NodeOffset end = kNeighbourTable[t][n];
      Between& between = table[t][n];
      for (const NodeOffset& o : kNeighbourTable[t])
        if (!(o == end) && touches(centroid({0, 0, t}), centroid(end), o))
          between.offset.at(static_cast<std::size_t>(between.count++)) = o;
    }
  return table;
}();

// kBack[t][n]: which neighbour of its n-th neighbour a triangle t is.
constexpr auto kBack = [] {
  std::array<std::array<std::uint8_t, kNeighbours>, kTriangles> table{};
  for (std::uint8_t t = 0; t < kTriangles; ++t)
    for (std::size_t n = 0; n < kNeighbours; ++n) {
      const NodeOffset o = kNeighbourTable[t][n];
      const NodeOffset back{static_cast<std::int8_t>(-o.col), static_cast<std::int8_t>(-o.row), t};
      std::uint8_t m = 0;
      while (!(kNeighbourTable[o.triangle].at(m) == back)) ++m;
      table[t][n] = m;
    }
  return table;
}();

constexpr bool forward(std::uint8_t t, NodeOffset o) {
  return o.row > 0 || (o.row == 0 && (o.col > 0 || (o.col == 0 && o.triangle > t)));
}

Eigen::Vector3d normal(const GraphNode& n, double r_mm) {
  const double x = n.rise_x_mm, y = n.rise_y_mm, length = std::sqrt(x * x + y * y + r_mm * r_mm);
  return {-x / length, -y / length, r_mm / length};
}

}  // namespace

Centroid centroid_of(NodeId id, const GraphNode& node, const Lattice& lattice) {
  const std::int32_t r = lattice.resolution_mm();
  const std::int64_t rise = id.triangle == kEast    ? node.rise_x_mm
                            : id.triangle == kNorth ? node.rise_y_mm
                            : id.triangle == kWest  ? -std::int64_t{node.rise_x_mm}
                                                    : -std::int64_t{node.rise_y_mm};
  return {3 * lattice.centre_x_mm(id.cell) + centroid_x3(id.triangle, r),
          3 * lattice.centre_y_mm(id.cell) + centroid_y3(id.triangle, r), 3 * std::int64_t{node.centre_mm} + rise};
}

double distance_m(const Centroid& a, const Centroid& b) {
  const auto x = static_cast<double>(b.x3 - a.x3), y = static_cast<double>(b.y3 - a.y3),
             z = static_cast<double>(b.z3 - a.z3);
  return std::sqrt(x * x + y * y + z * z) / 3000;
}

TileGraph::TileGraph(const TerrainTile& tile, std::span<const std::shared_ptr<const TerrainTile>> around,
                     const ConvexityRules& rules)
    : lattice_(tile.resolution_mm),
      box_(tile.box),
      held_(tile.box.grown(1)),
      nodes_(static_cast<std::size_t>(held_.cells() * kTriangles)) {
  take(tile);
  for (const auto& other : around) take(*other);
  join(rules);
}

void TileGraph::take(const TerrainTile& tile) {
  const CellBox shared = tile.box.intersect(held_);
  for (std::int32_t row = shared.row0; row < shared.row1; ++row)
    for (std::int32_t col = shared.col0; col < shared.col1; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const NodeId id{{col, row}, t};
        const NodeSurface& surface = tile.nodes[tile.node_index(id)];
        if (surface.state == NodeState::kUnknown || surface.cost == kNotTraversable) continue;
        const FinalPlane plane = FinalPlane::through(t, tile.corners_mm(id));
        nodes_[index(id)] = {static_cast<std::int32_t>(plane.centre_mm), static_cast<std::int32_t>(plane.rise_x_mm),
                             static_cast<std::int32_t>(plane.rise_y_mm), 0, surface.cost};
      }
}

// Every edge once, from the smaller key. Those between two nodes of the ring are not wanted, and not all are found.
void TileGraph::join(const ConvexityRules& rules) {
  const double r_mm = lattice_.resolution_mm();
  std::vector<Eigen::Vector3d> normals(nodes_.size());
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    if (nodes_[i].exists()) normals[i] = normal(nodes_[i], r_mm);
  const auto at = [](NodeId id, NodeOffset o) {
    return NodeId{{id.cell.col + o.col, id.cell.row + o.row}, o.triangle};
  };
  for (std::int32_t row = held_.row0; row < held_.row1; ++row)
    for (std::int32_t col = held_.col0; col < held_.col1; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const NodeId id{{col, row}, t};
        const GraphNode* node = find(id);
        if (!node) continue;
        const bool own = box_.contains(id.cell);
        const Centroid here = centroid_of(id, *node, lattice_);
        for (std::size_t n = 0; n < kNeighbours; ++n) {
          if (!forward(t, kNeighbourTable[t][n])) continue;
          const NodeId other = at(id, kNeighbourTable[t][n]);
          if (!own && !box_.contains(other.cell)) continue;
          const GraphNode* end = find(other);
          if (!end) continue;
          const Between& between = kBetween[t][n];
          if (!std::all_of(between.offset.begin(), between.offset.begin() + between.count,
                           [&](NodeOffset o) { return find(at(id, o)) != nullptr; }))
            continue;
          const Centroid there = centroid_of(other, *end, lattice_);
          const Eigen::Vector3d d_mm(static_cast<double>(there.x3 - here.x3) / 3,
                                     static_cast<double>(there.y3 - here.y3) / 3,
                                     static_cast<double>(there.z3 - here.z3) / 3);
          if (!locally_convex(normals[index(id)], normals[index(other)], d_mm, rules)) continue;
          if (own) nodes_[index(id)].edges |= static_cast<std::uint16_t>(1u << n);
          if (box_.contains(other.cell)) nodes_[index(other)].edges |= static_cast<std::uint16_t>(1u << kBack[t][n]);
        }
      }
}

}  // namespace btms
