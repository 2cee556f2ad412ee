#include "engine/routing/route.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <queue>
#include <tuple>
#include <unordered_map>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"
#include "engine/query/footprint.h"
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

// The graph as the vehicle of the rules can use it.
struct Ground {
  const TraversalGraph& map;
  const RouteRules& rules;
  GraphReader graph{map};

  const Lattice& lattice() const { return map.layout().lattice; }
  // Whether the vehicle may go straight from one place to the other. Precondition: the line lies on nodes.
  bool passable(Place from, Place to) const {
    const Place line[] = {from, to};
    return rules.width_m == 0 || check_path(map.terrain(), line, rules.width_m / 2, rules.limits).safe;
  }
  Place place_of(NodeId id) {
    const Centroid c = centroid_of(id, *graph.find(id), lattice());
    return {static_cast<double>(c.x3) / 3000, static_cast<double>(c.y3) / 3000};
  }
};

// An end of the route: a node and a place on it.
struct End {
  NodeId id;
  Place place;
};

// The node below the place, else the nearest by its centroid, of equally near ones that of the smaller key.
std::optional<End> snap(Ground& ground, Place place) {
  if (!is_place(place)) return {};
  const Lattice& lattice = ground.lattice();
  GraphReader& graph = ground.graph;
  const NodeId own = lattice.node_at(millimetres(place.x_m), millimetres(place.y_m));
  if (graph.find(own) && ground.passable(rounded(place), ground.place_of(own))) return End{own, rounded(place)};

  constexpr double kMostSquares = 1024;
  const double r_m = lattice.resolution_m();
  const double most_m = ground.rules.snap_m;
  const double most = std::min(std::isfinite(most_m) ? std::max(most_m, 0.0) : 0.0, kMostSquares * r_m);
  std::optional<End> best;
  double best2 = most * most;
  const auto look = [&](Cell cell) {
    for (std::uint8_t t = 0; t < kTriangles; ++t) {
      const NodeId id{cell, t};
      if (!graph.find(id)) continue;
      const Place at = ground.place_of(id);
      const double dx = at.x_m - place.x_m, dy = at.y_m - place.y_m, distance2 = dx * dx + dy * dy;
      if (distance2 > best2 || (best && distance2 == best2 && node_key(best->id) < node_key(id))) continue;
      if (!ground.passable(at, at)) continue;
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
//
// Whether the vehicle can follow an edge is looked at only when the best way to a node that is to be settled ends with
// it: nearly all edges that matter are fine, and most don't matter.
RouteStatus search(Ground& ground, NodeId start, NodeId goal, std::vector<NodeId>& way, std::size_t& settled) {
  struct Open {
    double bound;  // of the weight of a whole way over it
    NodeKey key;
    bool operator<(const Open& o) const { return bound != o.bound ? bound > o.bound : key > o.key; }
  };
  const RouteRules& rules = ground.rules;
  GraphReader& graph = ground.graph;
  const Lattice& lattice = ground.lattice();
  const Centroid aim = centroid_of(goal, *graph.find(goal), lattice);
  std::priority_queue<Open> open;
  Known known;
  known.of(start).weight = 0;
  open.push({distance_m(centroid_of(start, *graph.find(start), lattice), aim), node_key(start)});
  while (!open.empty()) {
    const auto [bound, key] = open.top();
    const NodeId at = node_of_key(key);
    open.pop();
    Known::Node& node = known.of(at);
    const double ahead = distance_m(centroid_of(at, *graph.find(at), lattice), aim);
    if (node.settled || bound != node.weight + ahead) continue;  // another entry speaks for it
    if (at != start && !ground.passable(ground.place_of(node_of_key(node.from)), ground.place_of(at))) {
      // The best of the other ways known so far; of equally good ones that from the smaller key.
      const std::pair refused{node.weight, node.from};
      std::pair best{std::numeric_limits<double>::infinity(), NodeKey{0}};
      graph.at(at.cell)->for_each_edge(at, rules.cost_weight, [&](NodeId from, const GraphNode&, double edge) {
        const Known::Node& other = known.of(from);
        const std::pair way_there{other.weight + edge, node_key(from)};
        if (other.settled && way_there > refused) best = std::min(best, way_there);
      });
      std::tie(node.weight, node.from) = best;
      if (!std::isinf(node.weight)) open.push({node.weight + ahead, key});
      continue;
    }
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
std::vector<Place> straightened(Ground& ground, const std::vector<Place>& places) {
  GraphReader& graph = ground.graph;
  const double cost_weight = ground.rules.cost_weight;
  std::vector<double> weight = {0};  // from the first place
  for (std::size_t i = 1; i < places.size(); ++i) {
    weight.push_back(weight.back() + straight_line(graph, places[i - 1], places[i], cost_weight)->weight);
  }
  const auto can_skip = [&](std::size_t from, std::size_t to) {
    constexpr double kDust = 1e-9;       // of sums in another order
    constexpr double kLongest_r = 1000;  // also keeps checks within kMostCheckWork
    if (to == from + 1) return true;
    const Place a = places[from], b = places[to];
    if (std::hypot(a.x_m - b.x_m, a.y_m - b.y_m) > kLongest_r * ground.lattice().resolution_m()) return false;
    const auto line = straight_line(graph, a, b, cost_weight);
    return line && line->joined && line->weight <= (weight[to] - weight[from]) * (1 + kDust) && ground.passable(a, b);
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
  if (!(rules.width_m >= 0)) throw Error(ErrorCode::kUsage, "width_m: expected 0 or more");
  Ground ground{map, rules};
  GraphReader& graph = ground.graph;
  Route answer;
  const auto start = snap(ground, from), goal = snap(ground, to);
  if (!start || !goal) {
    answer.status = start ? RouteStatus::kNoGoal : RouteStatus::kNoStart;
    return answer;
  }
  std::vector<NodeId> way;
  answer.status = search(ground, start->id, goal->id, way, answer.settled);
  if (answer.status != RouteStatus::kFound) return answer;

  std::vector<Place> places = {start->place};
  const auto add = [&](Place p) {
    if (!(p == places.back())) places.push_back(p);
  };
  if (way.size() > 1)
    for (const NodeId id : way) add(ground.place_of(id));
  add(goal->place);
  if (rules.shape == RouteRules::Shape::kStraightened) places = straightened(ground, places);

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
