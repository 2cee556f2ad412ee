#include "engine/routing/route.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <queue>
#include <unordered_map>

#include "engine/lattice/coordinates.h"
#include "engine/routing/graph_reader.h"
#include "engine/routing/straight_line.h"

namespace btms {
namespace {

constexpr double kLimit_m = static_cast<double>(kMaxHorizontal_mm) / 2000;
bool is_place(Place p) { return std::abs(p.x_m) <= kLimit_m && std::abs(p.y_m) <= kLimit_m; }
std::int64_t millimetres(double m) { return static_cast<std::int64_t>(std::floor(m * 1000 + 0.5)); }
// As points are.
Place rounded(Place p) {
  return {static_cast<double>(millimetres(p.x_m)) / 1000, static_cast<double>(millimetres(p.y_m)) / 1000};
}

Place place_of(const Centroid& c) { return {static_cast<double>(c.x3) / 3000, static_cast<double>(c.y3) / 3000}; }

// An end of the route: a node and a place on it.
struct End {
  NodeId id;
  Place place;
};

// The node below the place, else the nearest by its centroid, of equally near ones that of the smaller key.
std::optional<End> snap(GraphReader& graph, Place place, double most_m) {
  if (!is_place(place)) return {};
  const Lattice& lattice = graph.layout().lattice;
  const NodeId own = lattice.node_at(millimetres(place.x_m), millimetres(place.y_m));
  if (graph.find(own)) return End{own, rounded(place)};

  constexpr double kMostSquares = 1024;
  const double r_m = lattice.resolution_m();
  const double most = std::min(std::isfinite(most_m) ? std::max(most_m, 0.0) : 0.0, kMostSquares * r_m);
  std::optional<End> best;
  double best2 = most * most;
  const auto look = [&](Cell cell) {
    for (std::uint8_t t = 0; t < kTriangles; ++t) {
      const NodeId id{cell, t};
      const GraphNode* node = graph.find(id);
      if (!node) continue;
      const Place at = place_of(centroid_of(id, *node, lattice));
      const double dx = at.x_m - place.x_m, dy = at.y_m - place.y_m, distance2 = dx * dx + dy * dy;
      if (distance2 > best2 || (best && distance2 == best2 && node_key(best->id) < node_key(id))) continue;
      best = {id, at};
      best2 = distance2;
    }
  };
  // Squares at ring k are at least (k - 1) r away.
  for (std::int32_t ring = 0; std::max(ring - 1, 0) * r_m <= std::sqrt(best2); ++ring)
    for (std::int32_t d = -ring; d <= ring; ++d) {
      look({own.cell.col + d, own.cell.row - ring});
      if (ring > 0) look({own.cell.col + d, own.cell.row + ring});
      if (std::abs(d) == ring) continue;
      look({own.cell.col - ring, own.cell.row + d});
      look({own.cell.col + ring, own.cell.row + d});
    }
  return best;
}

// What a search knows of the nodes it has met, in blocks of squares that have nothing to do with tiles.
class Known {
 public:
  struct Node {
    double weight = std::numeric_limits<double>::infinity();  // of the best way there so far
    NodeKey from = 0;
    bool settled = false;
  };

  Node& of(NodeId id) {
    const Cell block{id.cell.col >> kBits, id.cell.row >> kBits};
    if (!last_ || block != last_block_) {
      auto& nodes = blocks_[node_key({block, 0})];
      if (!nodes) nodes = std::make_unique<Node[]>(kNodes);
      last_block_ = block;
      last_ = nodes.get();
    }
    constexpr std::int32_t kMask = (1 << kBits) - 1;
    const auto cell = static_cast<std::size_t>((id.cell.row & kMask) << kBits | (id.cell.col & kMask));
    return last_[cell * kTriangles + id.triangle];
  }
  std::size_t bytes() const { return blocks_.size() * kNodes * sizeof(Node); }

 private:
  static constexpr int kBits = 5;
  static constexpr std::size_t kNodes = (std::size_t{1} << 2 * kBits) * kTriangles;
  std::unordered_map<NodeKey, std::unique_ptr<Node[]>> blocks_;
  Cell last_block_;
  Node* last_ = nullptr;
};

// The nodes from start to goal; empty unless the status is kFound. The heuristic is the straight line in space: every
// edge weighs at least its length, so it never exceeds what is left, nor falls by more than the edge taken.
RouteStatus search(GraphReader& graph, NodeId start, NodeId goal, const RouteRules& rules, std::vector<NodeId>& way,
                   std::size_t& settled) {
  struct Open {
    double bound;  // of the weight of a whole way over it
    NodeKey key;
    bool operator<(const Open& o) const { return bound != o.bound ? bound > o.bound : key > o.key; }
  };
  const Lattice& lattice = graph.layout().lattice;
  const Centroid aim = centroid_of(goal, *graph.find(goal), lattice);
  std::priority_queue<Open> open;
  Known known;
  known.of(start).weight = 0;
  open.push({distance_m(centroid_of(start, *graph.find(start), lattice), aim), node_key(start)});
  while (!open.empty()) {
    const NodeKey key = open.top().key;
    const NodeId at = node_of_key(key);
    open.pop();
    Known::Node& node = known.of(at);
    if (node.settled) continue;
    node.settled = true;
    ++settled;
    if (at == goal) {
      for (NodeId id = goal; id != start; id = node_of_key(known.of(id).from)) way.push_back(id);
      way.push_back(start);
      std::reverse(way.begin(), way.end());
      return RouteStatus::kFound;
    }
    if (settled >= rules.most_nodes || known.bytes() + open.size() * sizeof(Open) > rules.most_bytes)
      return RouteStatus::kTooFar;
    const double weight = node.weight;
    graph.at(at.cell)->for_each_edge(at, rules.cost_weight, [&](NodeId to, const GraphNode& end, double edge) {
      Known::Node& next = known.of(to);
      if (next.settled || !(weight + edge < next.weight)) return;
      next.weight = weight + edge;
      next.from = key;
      open.push({next.weight + distance_m(centroid_of(to, end, lattice), aim), node_key(to)});
    });
  }
  return RouteStatus::kBlocked;
}

// Leaves places out where the straight line past them weighs no more than the way over them.
std::vector<Place> straightened(GraphReader& graph, const std::vector<Place>& places, double cost_weight) {
  std::vector<double> weight = {0};  // from the first place
  for (std::size_t i = 1; i < places.size(); ++i) {
    weight.push_back(weight.back() + straight_line(graph, places[i - 1], places[i], cost_weight)->weight);
  }
  const auto can_skip = [&](std::size_t from, std::size_t to) {
    constexpr double kDust = 1e-9;  // of sums in another order
    if (to == from + 1) return true;
    const auto line = straight_line(graph, places[from], places[to], cost_weight);
    return line && line->joined && line->weight <= (weight[to] - weight[from]) * (1 + kDust);
  };
  std::vector<Place> kept = {places.front()};
  for (std::size_t at = 0; at + 1 < places.size();) {
    // Twice as far as long as it works, then halves: a line that is refused seldom has a longer one that is not.
    std::size_t good = at + 1, stride = 1, bad = places.size();
    while (good < places.size() - 1) {
      const std::size_t next = std::min(good + stride, places.size() - 1);
      if (!can_skip(at, next)) {
        bad = next;
        break;
      }
      good = next;
      stride *= 2;
    }
    while (good + 1 < bad) {
      const std::size_t middle = good + (bad - good) / 2;
      (can_skip(at, middle) ? good : bad) = middle;
    }
    kept.push_back(places[good]);
    at = good;
  }
  return kept;
}

double height_m(GraphReader& graph, Place place) {
  const Lattice& lattice = graph.layout().lattice;
  const NodeId id = lattice.node_at(millimetres(place.x_m), millimetres(place.y_m));
  const GraphNode& node = *graph.find(id);
  const double x_mm = place.x_m * 1000 - static_cast<double>(lattice.centre_x_mm(id.cell));
  const double y_mm = place.y_m * 1000 - static_cast<double>(lattice.centre_y_mm(id.cell));
  return (node.centre_mm + (node.rise_x_mm * x_mm + node.rise_y_mm * y_mm) / lattice.resolution_mm()) / 1000;
}

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

Route find_route(const TraversalGraph& map, Place from, Place to, const RouteRules& rules) {
  GraphReader graph(map);
  Route answer;
  const auto start = snap(graph, from, rules.snap_m), goal = snap(graph, to, rules.snap_m);
  if (!start || !goal) {
    answer.status = start ? RouteStatus::kNoGoal : RouteStatus::kNoStart;
    return answer;
  }
  std::vector<NodeId> way;
  answer.status = search(graph, start->id, goal->id, rules, way, answer.settled);
  if (answer.status != RouteStatus::kFound) return answer;

  std::vector<Place> places = {start->place};
  const auto add = [&](Place p) {
    if (!(p == places.back())) places.push_back(p);
  };
  if (way.size() > 1)
    for (const NodeId id : way) add(place_of(centroid_of(id, *graph.find(id), map.layout().lattice)));
  add(goal->place);
  if (rules.shape == RouteRules::Shape::kStraightened) places = straightened(graph, places, rules.cost_weight);

  double steepest = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    answer.points.push_back({places[i], height_m(graph, places[i])});
    if (i == 0) continue;
    const auto line =
        straight_line(graph, places[i - 1], places[i], rules.cost_weight);  // an edge, or looked at before
    answer.length_m += line->length_m;
    answer.weight += line->weight;
    steepest = std::max(steepest, line->steepest);
  }
  answer.steepest_deg = std::atan(steepest) * (180 / 3.14159265358979323846);
  return answer;
}

}  // namespace btms
