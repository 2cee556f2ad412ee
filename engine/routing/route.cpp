#include "engine/routing/route.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>
#include <queue>

#include "engine/lattice/coordinates.h"

namespace btms {
namespace {

constexpr std::uint8_t kNobody = 255;

// A tile while a search goes over it.
struct Visited {
  std::shared_ptr<const TileGraph> graph;
  std::vector<double> weight;      // from the start; infinite: not reached
  std::vector<std::uint8_t> from;  // which neighbour it was reached from
};

class Search {
 public:
  Search(const TraversalGraph& graph, const RouteRules& rules)
      : graph_(graph), rules_(rules), layout_(graph.terrain().layout()), r_m_(layout_.lattice.resolution_m()) {}

  Route between(Place start, Place goal) {
    Route route;
    const auto from = snap(start), to = snap(goal);
    if (!from || !to) {
      route.status = from ? RouteStatus::kNoGoal : RouteStatus::kNoStart;
      return route;
    }
    goal_ = *to;
    goal_at_ = at(goal_);
    route.status = run(*from);
    route.settled = settled_;
    if (route.status == RouteStatus::kFound) trace(*from, route);
    return route;
  }

 private:
  struct Waiting {
    double estimate;  // weight so far and at least still to come
    NodeKey key;
    double weight;
    // Of equal estimates the one that has come further, then the smaller key.
    friend bool operator<(const Waiting& a, const Waiting& b) {
      if (a.estimate != b.estimate) return a.estimate > b.estimate;
      if (a.weight != b.weight) return a.weight < b.weight;
      return a.key > b.key;
    }
  };

  // nullptr where nothing of the map is; the tile asked for last is at hand.
  Visited* visit(Cell cell) {
    if (last_ && last_->graph->box.contains(cell)) return last_;
    const TileId id = layout_.grid.tile_of(cell);
    auto it = visited_.find(id);
    if (it == visited_.end()) {
      Visited visited{graph_.tile(id), {}, {}};
      if (visited.graph) {
        visited.weight.assign(visited.graph->cost.size(), std::numeric_limits<double>::infinity());
        visited.from.assign(visited.graph->cost.size(), kNobody);
      }
      it = visited_.emplace(id, std::move(visited)).first;
    }
    if (!it->second.graph || !it->second.graph->box.contains(cell)) return nullptr;
    return last_ = &it->second;
  }
  bool is_node(NodeId id) {
    const Visited* tile = visit(id.cell);
    return tile && tile->graph->cost[tile->graph->index(id)] != kNotTraversable;
  }

  struct Spot {
    double x_m, y_m, z_m;
  };
  Spot at(NodeId id) {
    const Visited& tile = *visit(id.cell);
    const auto x3 =
        3 * layout_.lattice.centre_x_mm(id.cell) + centroid_x3(id.triangle, layout_.lattice.resolution_mm());
    const auto y3 =
        3 * layout_.lattice.centre_y_mm(id.cell) + centroid_y3(id.triangle, layout_.lattice.resolution_mm());
    return {static_cast<double>(x3) / 3000, static_cast<double>(y3) / 3000,
            tile.graph->z_mm[tile.graph->index(id)] / 1000.0};
  }
  double cost(NodeId id) {
    const Visited& tile = *visit(id.cell);
    return tile.graph->cost[tile.graph->index(id)] / 254.0;
  }
  static double distance(const Spot& a, const Spot& b) {
    const double dx = a.x_m - b.x_m, dy = a.y_m - b.y_m, dz = a.z_m - b.z_m;
    return std::sqrt(dx * dx + dy * dy + dz * dz);
  }

  // The node that holds the place, or the nearest centroid within reach; of equally near ones the smaller key.
  std::optional<NodeId> snap(Place place) {
    constexpr double kLimit_m = static_cast<double>(kMaxHorizontal_mm) / 2000;
    if (!(std::abs(place.x_m) <= kLimit_m && std::abs(place.y_m) <= kLimit_m)) return {};
    const auto mm = [](double m) { return static_cast<std::int64_t>(std::floor(m * 1000 + 0.5)); };
    const NodeId own = layout_.lattice.node_at(mm(place.x_m), mm(place.y_m));
    if (is_node(own)) return own;
    const auto rings = static_cast<std::int32_t>(std::min(std::ceil(rules_.snap_m / r_m_), 64.0));
    std::optional<NodeId> best;
    double best2 = rules_.snap_m * rules_.snap_m;
    for (std::int32_t row = own.cell.row - rings; row <= own.cell.row + rings; ++row)
      for (std::int32_t col = own.cell.col - rings; col <= own.cell.col + rings; ++col)
        for (std::uint8_t t = 0; t < kTriangles; ++t) {
          const NodeId id{{col, row}, t};
          if (!is_node(id)) continue;
          const Spot spot = at(id);
          const double dx = spot.x_m - place.x_m, dy = spot.y_m - place.y_m, distance2 = dx * dx + dy * dy;
          if (distance2 < best2 || (!best && distance2 == best2)) {
            best = id;
            best2 = distance2;
          }
        }
    return best;
  }

  RouteStatus run(NodeId start) {
    std::priority_queue<Waiting> waiting;
    {
      Visited& tile = *visit(start.cell);
      tile.weight[tile.graph->index(start)] = 0;
      waiting.push({distance(at(start), goal_at_), node_key(start), 0});
    }
    while (!waiting.empty()) {
      const Waiting next = waiting.top();
      waiting.pop();
      const NodeId node = node_of_key(next.key);
      Visited* tile = visit(node.cell);
      const std::size_t i = tile->graph->index(node);
      if (next.weight > tile->weight[i]) continue;  // reached on a cheaper way since
      if (node == goal_) return RouteStatus::kFound;
      if (++settled_ > rules_.most_nodes || visited_.size() > rules_.most_tiles) return RouteStatus::kTooFar;
      const Spot here = at(node);
      const double cost_here = tile->graph->cost[i] / 254.0;
      for (unsigned edges = tile->graph->edges[i]; edges != 0; edges &= edges - 1) {
        const auto k = static_cast<std::uint8_t>(std::countr_zero(edges));
        const NodeId other = neighbour(node, k);
        Visited* there = visit(other.cell);
        const std::size_t j = there->graph->index(other);
        const Spot spot = at(other);
        const double weight =
            next.weight +
            distance(here, spot) * (1 + rules_.cost_weight * (cost_here + there->graph->cost[j] / 254.0) / 2);
        if (!(weight < there->weight[j])) continue;
        there->weight[j] = weight;
        there->from[j] = kBackwards[node.triangle][k];
        waiting.push({weight + distance(spot, goal_at_), node_key(other), weight});
      }
    }
    return RouteStatus::kBlocked;
  }

  void trace(NodeId start, Route& route) {
    std::vector<NodeId> nodes{goal_};
    while (nodes.back() != start) {
      Visited& tile = *visit(nodes.back().cell);
      nodes.push_back(neighbour(nodes.back(), tile.from[tile.graph->index(nodes.back())]));
    }
    std::reverse(nodes.begin(), nodes.end());
    std::vector<double> weights;
    for (const NodeId& n : nodes) {
      Visited& tile = *visit(n.cell);
      weights.push_back(tile.weight[tile.graph->index(n)]);
    }
    route.weight = weights.back();
    const auto add = [&](NodeId n) {
      const Spot s = at(n);
      route.points.push_back({{s.x_m, s.y_m}, s.z_m});
    };
    // From every node the longest straight line, by doubling and then halving, that is no worse than the way.
    add(nodes[0]);
    for (std::size_t i = 0; i + 1 < nodes.size();) {
      const auto fits = [&](std::size_t k) {
        return straight(nodes[i], nodes[k], (weights[k] - weights[i]) * (1 + 1e-9));
      };
      std::size_t good = i + 1, step = 2;
      while (i + step < nodes.size() && fits(i + step)) {
        good = i + step;
        step *= 2;
      }
      for (std::size_t half = step / 2; half > 0; half /= 2)
        if (good + half < nodes.size() && good + half < i + step && fits(good + half)) good += half;
      add(nodes[good]);
      i = good;
    }
    for (std::size_t i = 1; i < route.points.size(); ++i) {
      const RoutePoint &a = route.points[i - 1], &b = route.points[i];
      const double flat = std::hypot(b.place.x_m - a.place.x_m, b.place.y_m - a.place.y_m);
      route.length_m += std::hypot(flat, b.z_m - a.z_m);
      if (flat > 0)
        route.steepest_deg =
            std::max(route.steepest_deg, std::atan(std::abs(b.z_m - a.z_m) / flat) * 180 / std::numbers::pi);
    }
  }

  // Whether the line crosses nodes of the graph only, from one to the next over edges, and weighs no more.
  bool straight(NodeId from, NodeId to, double most) {
    const Spot a = at(from), b = at(to);
    const double length = distance(a, b);
    if (length > most) return false;
    const auto steps = static_cast<std::size_t>(std::ceil(std::hypot(b.x_m - a.x_m, b.y_m - a.y_m) / (r_m_ / 8)));
    NodeId before = from;
    double weight = 0;
    for (std::size_t s = 1; s <= steps; ++s) {
      const double share = (static_cast<double>(s) - 0.5) / static_cast<double>(steps);
      const auto mm = [](double m) { return static_cast<std::int64_t>(std::floor(m * 1000 + 0.5)); };
      const NodeId node =
          layout_.lattice.node_at(mm(a.x_m + share * (b.x_m - a.x_m)), mm(a.y_m + share * (b.y_m - a.y_m)));
      if (!is_node(node) || !joined(before, node)) return false;
      before = node;
      weight += length / static_cast<double>(steps) * (1 + rules_.cost_weight * cost(node));
    }
    return joined(before, to) && weight <= most;
  }
  bool joined(NodeId a, NodeId b) {
    if (a == b) return true;
    const Visited& tile = *visit(a.cell);
    for (unsigned edges = tile.graph->edges[tile.graph->index(a)]; edges != 0; edges &= edges - 1)
      if (neighbour(a, static_cast<std::uint8_t>(std::countr_zero(edges))) == b) return true;
    return false;
  }

  const TraversalGraph& graph_;
  const RouteRules& rules_;
  const MapLayout& layout_;
  const double r_m_;
  std::unordered_map<TileId, Visited, TileIdHash> visited_;
  Visited* last_ = nullptr;
  NodeId goal_;
  Spot goal_at_{};
  std::size_t settled_ = 0;
};

}  // namespace

const char* route_status_name(RouteStatus status) {
  switch (status) {
    case RouteStatus::kFound:
      return "found";
    case RouteStatus::kNoStart:
      return "no_start";
    case RouteStatus::kNoGoal:
      return "no_goal";
    case RouteStatus::kTooFar:
      return "too_far";
    case RouteStatus::kBlocked:
      break;
  }
  return "blocked";
}

Route find_route(const TraversalGraph& graph, Place start, Place goal, const RouteRules& rules) {
  return Search(graph, rules).between(start, goal);
}

}  // namespace btms
