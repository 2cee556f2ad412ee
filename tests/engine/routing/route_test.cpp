// The traversal graph, and ways over it.
#include "engine/routing/route.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "engine/model/memory_map.h"
#include "tests/support/cloud.h"

namespace btms {
namespace {

// Rolling ground of 64 x 64 squares of 1 m with a wall across the middle that has a gap, cut into any tiles.
TraversalGraph walled(std::int32_t tile_cells, bool gap = true) {
  const MapLayout layout{Lattice(1000), {tile_cells, {}}};
  auto map = std::make_shared<MemoryMap>(layout);
  const auto height_mm = [](double x, double y) {
    return static_cast<std::int32_t>(600 * std::sin(x / 9) * std::cos(y / 7));
  };
  layout.grid.for_each_tile({0, 0, 64, 64}, [&](TileId id) {
    TerrainTile tile(1000, layout.grid.box_of(id).intersect({0, 0, 64, 64}));
    for (std::int32_t row = tile.box.row0; row <= tile.box.row1; ++row)
      for (std::int32_t col = tile.box.col0; col <= tile.box.col1; ++col) {
        tile.corner_mm[tile.corner_index({col, row})] = height_mm(col, row);
        if (!tile.box.contains({col, row})) continue;
        tile.centre_mm[tile.cell_index({col, row})] = height_mm(col + 0.5, row + 0.5);
        for (std::uint8_t t = 0; t < kTriangles; ++t) {
          NodeSurface& node = tile.nodes[tile.node_index({{col, row}, t})];
          node.state = NodeState::kObserved;
          const bool wall = (row == 31 || row == 32) && !(gap && col >= 50 && col < 53);
          node.cost = wall ? kNotTraversable : static_cast<std::uint8_t>((col * 7 + row * 13 + t * 5) % 40);
        }
      }
    map->put(id, std::move(tile));
  });
  Parameters parameters;
  parameters.normal_similarity = 0.3;
  parameters.plane_distance = 0.3;
  return TraversalGraph(Terrain(map), parameters);
}

std::map<NodeKey, std::uint16_t> edges_of(const TraversalGraph& graph) {
  std::map<NodeKey, std::uint16_t> all;
  for (const TileId id : graph.terrain().tiles().tiles()) {
    const auto tile = graph.tile(id);
    for (std::int32_t row = tile->box.row0; row < tile->box.row1; ++row)
      for (std::int32_t col = tile->box.col0; col < tile->box.col1; ++col)
        for (std::uint8_t t = 0; t < kTriangles; ++t) {
          const NodeId n{{col, row}, t};
          all[node_key(n)] = tile->edges[tile->index(n)];
        }
  }
  return all;
}

TEST(TraversalGraph, IsTheSameForAnyTiling) {
  const auto whole = edges_of(walled(64));
  ASSERT_EQ(whole.size(), 64u * 64 * 4);
  for (const std::int32_t cells : {16, 7, 33}) EXPECT_EQ(edges_of(walled(cells)), whole) << cells;
}

TEST(TraversalGraph, EveryEdgeLeadsBack) {
  const auto edges = edges_of(walled(16));
  std::size_t count = 0;
  for (const auto& [key, mask] : edges)
    for (std::uint8_t k = 0; k < kNeighbours; ++k) {
      if (!(mask >> k & 1)) continue;
      ++count;
      const NodeId from = node_of_key(key), to = neighbour(from, k);
      const std::uint8_t back = kBackwards[from.triangle][k];
      ASSERT_EQ(neighbour(to, back), from);
      ASSERT_TRUE(edges.at(node_key(to)) >> back & 1);
    }
  EXPECT_GT(count, 100000u);
}

TEST(Route, GoesThroughTheGapTheSameWayForAnyTiling) {
  const Route whole = find_route(walled(64), {5, 5}, {8, 60});
  ASSERT_EQ(whole.status, RouteStatus::kFound);
  EXPECT_GT(whole.length_m, 2 * 42);  // over to the gap and back
  bool through = false;
  for (std::size_t i = 1; i < whole.points.size(); ++i) {
    const Place a = whole.points[i - 1].place, b = whole.points[i].place;
    if ((a.y_m < 32) != (b.y_m < 32)) through = std::min(a.x_m, b.x_m) > 49 && std::max(a.x_m, b.x_m) < 54;
  }
  EXPECT_TRUE(through);
  for (const std::int32_t cells : {16, 7}) {
    const Route other = find_route(walled(cells), {5, 5}, {8, 60});
    ASSERT_EQ(other.points.size(), whole.points.size());
    for (std::size_t i = 0; i < whole.points.size(); ++i) {
      EXPECT_EQ(other.points[i].place, whole.points[i].place);
      EXPECT_EQ(other.points[i].z_m, whole.points[i].z_m);
    }
    EXPECT_EQ(other.weight, whole.weight);
    EXPECT_EQ(other.settled, whole.settled);
  }
}

// Dijkstra by the book, over sets.
TEST(Route, IsTheCheapest) {
  const TraversalGraph graph = walled(16);
  const RouteRules rules;
  const auto edges = edges_of(graph);
  const auto spot = [&](NodeId n) {
    const auto tile = graph.tile(graph.terrain().layout().grid.tile_of(n.cell));
    const double x = n.cell.col + 0.5 + static_cast<double>(centroid_x3(n.triangle, 1000)) / 3000;
    const double y = n.cell.row + 0.5 + static_cast<double>(centroid_y3(n.triangle, 1000)) / 3000;
    return std::array<double, 4>{x, y, tile->z_mm[tile->index(n)] / 1000.0, tile->cost[tile->index(n)] / 254.0};
  };
  const NodeId start{{5, 5}, kEast}, goal{{8, 60}, kEast};
  std::map<NodeKey, double> best{{node_key(start), 0}};
  std::set<std::pair<double, NodeKey>> waiting{{0, node_key(start)}};
  while (!waiting.empty()) {
    const auto [weight, key] = *waiting.begin();
    waiting.erase(waiting.begin());
    const NodeId from = node_of_key(key);
    const auto a = spot(from);
    for (std::uint8_t k = 0; k < kNeighbours; ++k) {
      if (!(edges.at(key) >> k & 1)) continue;
      const NodeId to = neighbour(from, k);
      const auto b = spot(to);
      const double more =
          std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) * (1 + rules.cost_weight * (a[3] + b[3]) / 2);
      const auto known = best.find(node_key(to));
      if (known != best.end() && known->second <= weight + more) continue;
      if (known != best.end()) waiting.erase({known->second, node_key(to)});
      best[node_key(to)] = weight + more;
      waiting.insert({weight + more, node_key(to)});
    }
  }
  const Route route = find_route(graph, {5.9, 5.5}, {8.9, 60.5}, rules);
  EXPECT_NEAR(route.weight, best.at(node_key(goal)), 1e-6);
}

TEST(Route, SaysWhyThereIsNone) {
  const TraversalGraph graph = walled(16, false);
  EXPECT_EQ(find_route(graph, {5, 5}, {8, 60}).status, RouteStatus::kBlocked);
  EXPECT_EQ(find_route(graph, {-500, 5}, {8, 60}).status, RouteStatus::kNoStart);
  EXPECT_EQ(find_route(graph, {NAN, 5}, {8, 60}).status, RouteStatus::kNoStart);
  EXPECT_EQ(find_route(graph, {5, 5}, {INFINITY, 60}).status, RouteStatus::kNoGoal);
  EXPECT_EQ(find_route(graph, {5, 5}, {20.4, 31.1}).status, RouteStatus::kFound) << "snapped to the foot of the wall";
  RouteRules few;
  few.most_nodes = 100;
  EXPECT_EQ(find_route(graph, {5, 5}, {60, 20}, few).status, RouteStatus::kTooFar);
  const Route nowhere = find_route(graph, {5.9, 5.5}, {5.9, 5.5});
  EXPECT_EQ(nowhere.status, RouteStatus::kFound);
  EXPECT_EQ(nowhere.points.size(), 1u);
  EXPECT_EQ(nowhere.length_m, 0);
}

}  // namespace
}  // namespace btms
