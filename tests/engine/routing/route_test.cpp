// Routes over the graph.
#include "engine/routing/route.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "engine/query/footprint.h"
#include "tests/engine/routing/drawn_map.h"

namespace btms {
namespace {

using test::drawn;
using test::graph_of;

const std::vector<std::string> kWall = {
    "............",  //
    "............",  //
    ".....#......",  //
    ".....#......",  //
    ".....#......",  //
    ".....#......",
};

bool on_nodes(const TraversalGraph& graph, const Route& route) {
  const Lattice lattice = graph.layout().lattice;
  for (std::size_t i = 1; i < route.points.size(); ++i)
    for (double share = 0; share <= 1; share += 1.0 / 256) {
      const Place a = route.points[i - 1].place, b = route.points[i].place;
      const auto mm = [&](double p, double q) {
        return static_cast<std::int64_t>(std::floor(1000 * (p + share * (q - p)) + 0.5));
      };
      const NodeId id = lattice.node_at(mm(a.x_m, b.x_m), mm(a.y_m, b.y_m));
      const auto tile = graph.tile(graph.layout().grid.tile_of(id.cell));
      if (!tile || !tile->find(id)) return false;
    }
  return true;
}

TEST(Route, IsStraightOnLevelGround) {
  const auto graph = graph_of(drawn({"........", "........", "........"}), 3);
  const Route route = find_route(graph, {0.5, 1.25}, {15.5, 5});
  ASSERT_EQ(route.status, RouteStatus::kFound);
  ASSERT_EQ(route.points.size(), 2u);
  EXPECT_EQ(route.points[0].place, (Place{0.5, 1.25}));
  EXPECT_EQ(route.points[1].place, (Place{15.5, 5}));
  EXPECT_NEAR(route.length_m, std::hypot(15, 3.75), 1e-9);
  EXPECT_NEAR(route.weight, route.length_m, 1e-9);
  EXPECT_EQ(route.steepest_deg, 0);
}

TEST(Route, GoesRoundAWall) {
  const auto graph = graph_of(drawn(kWall), 4);
  for (const auto shape : {RouteRules::Shape::kStraightened, RouteRules::Shape::kNodes}) {
    RouteRules rules;
    rules.shape = shape;
    const Route route = find_route(graph, {3, 1}, {21, 1}, rules);
    ASSERT_EQ(route.status, RouteStatus::kFound);
    EXPECT_GT(route.length_m, 2 * std::hypot(7, 7)) << "over the wall's end at 10,8 and 12,8";
    EXPECT_LT(route.length_m, shape == RouteRules::Shape::kStraightened ? 24.5 : 26.5);
    EXPECT_TRUE(on_nodes(graph, route));
    EXPECT_EQ(shape == RouteRules::Shape::kNodes, route.points.size() > 10);
  }
}

TEST(Route, GoesRoundWhatCostsMore) {
  const auto graph = graph_of(drawn({".......", ".......", "..999..", "..999..", "..999.."}), 4);
  const Route round = find_route(graph, {1, 3}, {13, 3});
  ASSERT_EQ(round.status, RouteStatus::kFound);
  EXPECT_GT(round.length_m, 12.5);
  EXPECT_LT(round.weight, 12 + 6 * 3);
}

RouteRules rules_of_width(double width_m) {
  RouteRules rules;
  rules.width_m = width_m;
  rules.limits.slope_deg = 89;
  rules.limits.step_m = 100;
  return rules;
}

class RouteOfWidth : public testing::TestWithParam<double> {};

// Dijkstra without a heuristic, on one tile; the vehicle held against every edge beforehand.
TEST_P(RouteOfWidth, IsTheCheapest) {
  const auto graph = graph_of(test::rolling(), 128);
  const Lattice lattice = graph.layout().lattice;
  RouteRules rules = rules_of_width(GetParam());
  const auto centroid = [&](NodeId id) {
    const Centroid c = centroid_of(id, *graph.tile(graph.layout().grid.tile_of(id.cell))->find(id), lattice);
    return Place{static_cast<double>(c.x3) / 3000, static_cast<double>(c.y3) / 3000};
  };
  int refused = 0;
  const auto passable = [&](Place from, Place to) {
    const Place line[] = {from, to};
    return rules.width_m == 0 || check_path(graph.terrain(), line, rules.width_m / 2, rules.limits).safe;
  };
  const auto cheapest = [&](NodeId from, NodeId to) {
    std::map<NodeKey, double> best;
    std::multimap<double, NodeKey> open{{0, node_key(from)}};
    while (!open.empty()) {
      const auto [weight, key] = *open.begin();
      open.erase(open.begin());
      if (!best.emplace(key, weight).second) continue;
      const NodeId at = node_of_key(key);
      const double so_far = weight;
      graph.tile(graph.layout().grid.tile_of(at.cell))
          ->for_each_edge(at, rules.cost_weight, [&](NodeId end, const GraphNode&, double w) {
            if (best.contains(node_key(end))) return;
            if (passable(centroid(at), centroid(end)))
              open.emplace(so_far + w, node_key(end));
            else
              ++refused;
          });
    }
    return best.contains(node_key(to)) ? best[node_key(to)] : -1;
  };
  rules.shape = RouteRules::Shape::kNodes;
  const Place ends[][2] = {{{-60, -50}, {70, 60}}, {{-3, 40}, {5, -44}}, {{60, -30}, {-50, 10}}};
  for (const auto& [from, to] : ends) {
    const Route route = find_route(graph, from, to, rules);
    ASSERT_EQ(route.status, RouteStatus::kFound);
    // The edges of the way, read back from its centroids.
    std::vector<NodeId> way;
    for (const RoutePoint& p : route.points) {
      const NodeId id = lattice.node_at(std::llround(p.place.x_m * 1000), std::llround(p.place.y_m * 1000));
      if (way.empty() || way.back() != id) way.push_back(id);
    }
    double weight = 0;
    for (std::size_t i = 1; i < way.size(); ++i) {
      double edge = -1;
      graph.tile(graph.layout().grid.tile_of(way[i - 1].cell))
          ->for_each_edge(way[i - 1], rules.cost_weight, [&](NodeId end, const GraphNode&, double w) {
            if (end == way[i]) edge = w;
          });
      ASSERT_GT(edge, 0);
      weight += edge;
    }
    EXPECT_NEAR(weight, cheapest(way.front(), way.back()), 1e-9);
    EXPECT_GT(way.size(), 40u);
    const Route straight = find_route(graph, from, to, rules_of_width(GetParam()));
    EXPECT_LE(straight.weight, route.weight * (1 + 1e-9));
    EXPECT_LT(straight.points.size(), route.points.size());
    EXPECT_TRUE(on_nodes(graph, straight));
    for (const Route* r : {&route, &straight})
      for (std::size_t i = 1; i < r->points.size(); ++i)
        ASSERT_TRUE(passable(r->points[i - 1].place, r->points[i].place)) << i;
  }
  EXPECT_EQ(refused > 1000, GetParam() > 0) << refused;
}

INSTANTIATE_TEST_SUITE_P(Widths, RouteOfWidth, testing::Values(0, 0.8));

TEST(Route, DoesNotDependOnTheTiles) {
  for (const auto& [from, to] : {std::pair<Place, Place>{{-60, -50}, {70, 60}}, {{-3, 40}, {5, -44}}}) {
    const Route whole = find_route(graph_of(test::rolling(), 128), from, to);
    ASSERT_EQ(whole.status, RouteStatus::kFound);
    for (const std::int32_t edge : {1, 5, 16}) {
      // The least budget too: every tile is worked out many times.
      const Route tiled = find_route(graph_of(test::rolling(), edge, edge == 16 ? 1 : 1 << 20), from, to);
      ASSERT_EQ(tiled.points.size(), whole.points.size());
      for (std::size_t i = 0; i < whole.points.size(); ++i) {
        EXPECT_EQ(tiled.points[i].place, whole.points[i].place);
        EXPECT_EQ(tiled.points[i].z_m, whole.points[i].z_m);
      }
      EXPECT_EQ(tiled.length_m, whole.length_m);
      EXPECT_EQ(tiled.weight, whole.weight);
      EXPECT_EQ(tiled.settled, whole.settled);
    }
  }
}

TEST(Route, HeightsAreThoseOfTheSurface) {
  const auto map = test::rolling().cut(16);
  const Terrain terrain(map);
  const Route route = find_route(TraversalGraph(terrain, preset("city")), {-60, -50}, {70, 60});
  ASSERT_EQ(route.status, RouteStatus::kFound);
  for (const RoutePoint& p : route.points) EXPECT_NEAR(p.z_m, terrain.height(p.place).z_m, 0.001);
  EXPECT_GT(route.steepest_deg, 1);
}

TEST(Route, BlockedByAWallAndByItsCorners) {
  EXPECT_EQ(find_route(graph_of(drawn({"..#..", "..#..", "..#.."}), 2), {1, 1}, {9, 1}).status, RouteStatus::kBlocked);
  EXPECT_EQ(find_route(graph_of(drawn({".#", "#."}), 2), {3, 1}, {1, 3}).status, RouteStatus::kBlocked)
      << "between two corners that touch";
  test::MapMaker cliff = drawn({"......", "......"});
  cliff.height_mm = [](HalfCell h) { return h.x <= 6 ? 0 : 3000; };
  EXPECT_EQ(find_route(graph_of(cliff, 2), {1, 1}, {11, 1}).status, RouteStatus::kBlocked) << "not locally convex";
}

TEST(Route, SnapsToTheNearestNode) {
  const auto graph = graph_of(drawn({".....", ".....", "##...", "##..."}), 2);
  const Route route = find_route(graph, {1, 1}, {9, 1});
  ASSERT_EQ(route.status, RouteStatus::kFound);
  EXPECT_NEAR(route.points.front().place.x_m, 4 + 1.0 / 3, 1e-9) << "of two as near, that of the smaller key";
  EXPECT_NEAR(route.points.front().place.y_m, 1, 1e-9);
  RouteRules rules;
  rules.snap_m = 3;
  EXPECT_EQ(find_route(graph, {1, 1}, {9, 1}, rules).status, RouteStatus::kNoStart);
  EXPECT_EQ(find_route(graph, {9, 1}, {1, 1}, rules).status, RouteStatus::kNoGoal);
}

TEST(Route, IsTotal) {
  const auto graph = graph_of(drawn(kWall), 4);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  for (const double odd : {kNan, kInf, -kInf, 1e300, 5000.0, -5000.0}) {
    EXPECT_EQ(find_route(graph, {odd, 1}, {3, 1}).status, RouteStatus::kNoStart);
    EXPECT_EQ(find_route(graph, {3, 1}, {3, odd}).status, RouteStatus::kNoGoal);
    RouteRules rules;
    rules.snap_m = odd;
    EXPECT_EQ(find_route(graph, {3, 1}, {4, 1}, rules).status, RouteStatus::kFound);
  }
  const Route still = find_route(graph, {3, 1}, {3, 1});
  EXPECT_EQ(still.status, RouteStatus::kFound);
  EXPECT_EQ(still.length_m, 0);
  EXPECT_EQ(still.points.size(), 1u);
}

TEST(Route, StopsAtItsLimits) {
  const auto graph = graph_of(drawn(kWall), 4);
  RouteRules few;
  few.most_nodes = 20;
  const Route route = find_route(graph, {3, 1}, {21, 1}, few);
  EXPECT_EQ(route.status, RouteStatus::kTooFar);
  EXPECT_EQ(route.settled, 20u);
  EXPECT_TRUE(route.points.empty());
  RouteRules small;
  small.most_bytes = 1000;
  EXPECT_EQ(find_route(graph, {3, 1}, {21, 1}, small).status, RouteStatus::kTooFar);
}

}  // namespace
}  // namespace btms
