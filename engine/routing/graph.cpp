#include "engine/routing/graph.h"

#include <cmath>

#include "engine/terrain/local_convexity.h"

namespace btms {
namespace {

// What edges are decided by, of the nodes of a box.
struct Planes {
  CellBox box;
  std::vector<Eigen::Vector3d> normal, centroid_mm;  // about the south-west corner of the box
  std::vector<std::uint8_t> cost;

  explicit Planes(const CellBox& b)
      : box(b),
        normal(static_cast<std::size_t>(b.cells() * kTriangles)),
        centroid_mm(normal.size()),
        cost(normal.size(), kNotTraversable) {}
  std::size_t index(NodeId n) const {
    return static_cast<std::size_t>((std::int64_t{n.cell.row} - box.row0) * box.cols() + (n.cell.col - box.col0)) *
               kTriangles +
           n.triangle;
  }

  void take(const TerrainTile& tile, const CellBox& part) {
    const double r_mm = tile.resolution_mm;
    for (std::int32_t row = part.row0; row < part.row1; ++row)
      for (std::int32_t col = part.col0; col < part.col1; ++col)
        for (std::uint8_t t = 0; t < kTriangles; ++t) {
          const NodeId id{{col, row}, t};
          const NodeSurface& node = tile.nodes[tile.node_index(id)];
          if (node.state == NodeState::kUnknown || node.cost == kNotTraversable) continue;
          const FinalPlane plane = FinalPlane::through(t, tile.corners_mm(id));
          const double gx = static_cast<double>(plane.rise_x_mm) / r_mm,
                       gy = static_cast<double>(plane.rise_y_mm) / r_mm;
          const double length = std::sqrt(1 + gx * gx + gy * gy);
          const double x_mm = static_cast<double>(centroid_x3(t, tile.resolution_mm)) / 3;
          const double y_mm = static_cast<double>(centroid_y3(t, tile.resolution_mm)) / 3;
          const std::size_t i = index(id);
          cost[i] = node.cost;
          normal[i] = {-gx / length, -gy / length, 1 / length};
          centroid_mm[i] = {(col - box.col0 + 0.5) * r_mm + x_mm, (row - box.row0 + 0.5) * r_mm + y_mm,
                            static_cast<double>(plane.centre_mm) + gx * x_mm + gy * y_mm};
        }
  }
};

}  // namespace

TraversalGraph::TraversalGraph(Terrain terrain, const Parameters& parameters, std::size_t budget_bytes)
    : terrain_(std::move(terrain)), parameters_(parameters), budget_bytes_(budget_bytes) {}

TileGraph TraversalGraph::make(TileId id) const {
  const TileGrid& grid = terrain_.layout().grid;
  const auto own = terrain_.tiles().load(id);
  TileGraph graph;
  graph.box = own->box;
  Planes planes(own->box.grown(1));
  planes.take(*own, own->box);
  grid.for_each_tile(planes.box, [&](TileId around) {
    if (around == id) return;
    if (const auto tile = terrain_.tiles().load(around)) planes.take(*tile, planes.box.intersect(tile->box));
  });

  const std::size_t nodes = own->nodes.size();
  graph.edges.assign(nodes, 0);
  graph.z_mm.assign(nodes, kUnknownHeight_mm);
  graph.cost.assign(nodes, kNotTraversable);
  const ConvexityRules rules(parameters_);
  for (std::int32_t row = graph.box.row0; row < graph.box.row1; ++row)
    for (std::int32_t col = graph.box.col0; col < graph.box.col1; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const NodeId node{{col, row}, t};
        const std::size_t from = planes.index(node), i = graph.index(node);
        if (planes.cost[from] == kNotTraversable) continue;
        graph.cost[i] = planes.cost[from];
        graph.z_mm[i] = static_cast<std::int32_t>(std::floor(planes.centroid_mm[from].z() + 0.5));
        for (std::uint8_t k = 0; k < kNeighbours; ++k) {
          const NodeId other = neighbour(node, k);
          const std::size_t to = planes.index(other);
          if (planes.cost[to] == kNotTraversable) continue;
          // Looked at from the smaller key: rounded the same way in both tiles of a border.
          const bool forward = node_key(node) < node_key(other);
          const std::size_t a = forward ? from : to, b = forward ? to : from;
          if (locally_convex(planes.normal[a], planes.normal[b], planes.centroid_mm[b] - planes.centroid_mm[a], rules))
            graph.edges[i] = static_cast<std::uint16_t>(graph.edges[i] | 1u << k);
        }
      }
  return graph;
}

std::shared_ptr<const TileGraph> TraversalGraph::tile(TileId id) const {
  if (!terrain_.tiles().contains(id)) return nullptr;
  {
    const std::lock_guard lock(mutex_);
    if (const auto it = at_.find(id); it != at_.end()) {
      recent_.splice(recent_.begin(), recent_, it->second);
      return it->second->second;
    }
  }
  auto made = std::make_shared<const TileGraph>(make(id));
  const std::lock_guard lock(mutex_);
  if (const auto it = at_.find(id); it != at_.end()) return it->second->second;  // another thread was faster
  bytes_ += made->bytes();
  recent_.emplace_front(id, made);
  at_.emplace(id, recent_.begin());
  while (bytes_ > budget_bytes_ && recent_.size() > 1) {
    bytes_ -= recent_.back().second->bytes();
    at_.erase(recent_.back().first);
    recent_.pop_back();
  }
  return made;
}

}  // namespace btms
