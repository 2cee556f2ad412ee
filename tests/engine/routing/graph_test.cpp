// The traversability graph of finished tiles.
#include <gtest/gtest.h>

#include <map>

#include "engine/routing/graph.h"
#include "tests/engine/query/plane_shapes.h"
#include "tests/engine/routing/drawn_map.h"

namespace btms {
namespace {

using test::MapMaker;

using Edges = std::map<std::pair<NodeKey, NodeKey>, double>;

Edges edges_of(const TraversalGraph& graph, const MemoryMap& map) {
  Edges edges;
  for (const TileId id : map.tiles()) {
    const auto tile = graph.tile(id);
    const CellBox box = tile->box();
    for (std::int32_t row = box.row0; row < box.row1; ++row)
      for (std::int32_t col = box.col0; col < box.col1; ++col)
        for (std::uint8_t t = 0; t < kTriangles; ++t) {
          const NodeId from{{col, row}, t};
          if (!tile->find(from)) continue;
          tile->for_each_edge(from, 3, [&](NodeId to, const GraphNode&, double weight) {
            edges[{node_key(from), node_key(to)}] = weight;
          });
        }
  }
  return edges;
}

Edges edges_of(const MapMaker& maker, std::int32_t edge_cells, Cell origin = {}) {
  const auto map = maker.cut(edge_cells, origin);
  return edges_of(TraversalGraph(Terrain(map), preset("city")), *map);
}

TEST(TileGraph, LevelGroundJoinsAllNeighbours) {
  const Edges edges = edges_of(test::drawn({".....", ".....", ".....", ".....", "....."}), 128);
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    int joined = 0;
    for (const auto& [edge, weight] : edges) joined += edge.first == node_key({{2, 2}, t});
    EXPECT_EQ(joined, kNeighbours);
  }
  const NodeKey east = node_key({{2, 2}, kEast}), west = node_key({{2, 2}, kWest});
  EXPECT_DOUBLE_EQ((edges.at({east, west})), 4.0 / 3);
}

TEST(TileGraph, AWeightIsLengthTimesOneAndCost) {
  const Edges edges = edges_of(test::drawn({"99", "99"}), 128);
  const NodeKey east = node_key({{0, 0}, kEast}), west = node_key({{0, 0}, kWest});
  EXPECT_DOUBLE_EQ((edges.at({east, west})), 4.0 / 3 * (1 + 3));
}

// A direct reading of the definition, with none of the tables.
TEST(TileGraph, EdgesAreWhatTheDefinitionSays) {
  const MapMaker maker = test::rolling();
  const auto map = maker.cut(128);
  const Edges edges = edges_of(maker, 128);
  const ConvexityRules rules(preset("city"));
  const auto is_node = [&](NodeId id) { return maker.box.contains(id.cell) && maker.cost(id) != kNotTraversable; };
  const auto corners = [](NodeId id) {  // in thirds of a metre: exact
    std::vector<PlaceMm> places;
    for (const HalfCell h : triangle_corners(id.triangle))
      places.push_back({3 * (2 * id.cell.col + h.x), 3 * (2 * id.cell.row + h.y)});
    return places;
  };
  const auto centroid = [&](NodeId id) {
    Eigen::Vector3d sum(0, 0, 0);
    for (const HalfCell h : triangle_corners(id.triangle)) {
      const HalfCell at{2 * id.cell.col + h.x, 2 * id.cell.row + h.y};
      sum += Eigen::Vector3d(1000.0 * at.x, 1000.0 * at.y, maker.height_mm(at));
    }
    return Eigen::Vector3d(sum / 3);
  };
  const auto normal = [&](NodeId id) {
    std::array<Eigen::Vector3d, 3> p;
    for (std::size_t i = 0; i < 3; ++i) {
      const HalfCell h = triangle_corners(id.triangle)[i];
      const HalfCell at{2 * id.cell.col + h.x, 2 * id.cell.row + h.y};
      p[i] = Eigen::Vector3d(1000.0 * at.x, 1000.0 * at.y, maker.height_mm(at));
    }
    const Eigen::Vector3d a = p[1] - p[0], b = p[2] - p[0];
    const Eigen::Vector3d n(a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(),
                            a.x() * b.y() - a.y() * b.x());
    return Eigen::Vector3d(n / std::sqrt(n.dot(n)));
  };
  const auto thirds = [](const Eigen::Vector3d& p_mm) {
    return PlaceMm{std::llround(p_mm.x() * 3 / 1000), std::llround(p_mm.y() * 3 / 1000)};
  };
  std::size_t wanted = 0, not_convex = 0, squeezed = 0;
  for (std::int32_t row = -10; row < 10; ++row)
    for (std::int32_t col = -10; col < 10; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t)
        for (const NodeOffset& o : kNeighbourTable[t]) {
          const NodeId a{{col, row}, t}, b{{col + o.col, row + o.row}, o.triangle};
          if (!is_node(a) || !is_node(b)) continue;
          const Eigen::Vector3d ca = centroid(a), cb = centroid(b);
          bool free = true;
          for (const NodeOffset& other : kNeighbourTable[t]) {
            const NodeId c{{col + other.col, row + other.row}, other.triangle};
            if (!is_node(c) && test::polygons_meet(corners(c), {thirds(ca), thirds(cb)})) free = false;
          }
          const bool convex = locally_convex(normal(a), normal(b), Eigen::Vector3d(cb - ca), rules);
          ASSERT_EQ((edges.contains({node_key(a), node_key(b)})), free && convex)
              << col << " " << row << " " << int{t} << " to " << b.cell.col << " " << b.cell.row << " "
              << int{b.triangle};
          ++wanted;
          not_convex += free && !convex;
          squeezed += !free && convex;
        }
  EXPECT_GT(wanted, 10000u);
  EXPECT_GT(not_convex, 100u);
  EXPECT_GT(squeezed, 100u);
}

TEST(TileGraph, EdgesAreTheSameBothWays) {
  const Edges edges = edges_of(test::rolling(), 16);
  ASSERT_GT(edges.size(), 10000u);
  for (const auto& [edge, weight] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    ASSERT_NE(back, edges.end());
    ASSERT_EQ(back->second, weight);
  }
}

TEST(TileGraph, TheUnionOfTheTilesDoesNotDependOnThem) {
  const MapMaker maker = test::rolling();
  const Edges whole = edges_of(maker, 1000, {-500, -500});
  EXPECT_EQ(whole, edges_of(maker, 128));
  EXPECT_EQ(whole, edges_of(maker, 7, {3, 1}));
  EXPECT_EQ(whole, edges_of(maker, 1));
}

TEST(TraversalGraph, KeepsWhatWasAskedForLast) {
  const MapMaker maker = test::rolling();
  const TraversalGraph graph = test::graph_of(maker, 16, 1);
  const std::weak_ptr<const TileGraph> first = graph.tile({0, 0});
  EXPECT_EQ(graph.tile({0, 0}), first.lock());
  EXPECT_NE(graph.tile({0, 1}), nullptr);
  EXPECT_TRUE(first.expired());
  EXPECT_EQ(graph.tile({99, 0}), nullptr);
}

}  // namespace
}  // namespace btms
