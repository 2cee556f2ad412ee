// The cheapest way from one place to another over the traversal graph: A*, across tiles.
#pragma once

#include <cstddef>
#include <vector>

#include "engine/routing/graph.h"

namespace btms {

struct RouteRules {
  // An edge weighs its length over the surface times 1 + this times the mean cost of its nodes.
  double cost_weight = 4;
  double snap_m = 6;                    // from a place to the nearest node of the graph
  std::size_t most_nodes = 20'000'000;  // settled
  std::size_t most_tiles = 1024;        // held at once, 0.6 MB each at 128 cells
};

enum class RouteStatus { kFound, kNoStart, kNoGoal, kBlocked, kTooFar };
const char* route_status_name(RouteStatus status);  // "found", "no_start", "no_goal", "blocked", "too_far"

struct RoutePoint {
  Place place;
  double z_m = 0;
};

struct Route {
  RouteStatus status = RouteStatus::kBlocked;
  std::vector<RoutePoint> points;  // from start to goal: centroids, where it helps joined by straight lines
  double length_m = 0;             // over the surface
  double weight = 0;               // length weighed by cost
  double steepest_deg = 0;         // between points
  std::size_t settled = 0;         // nodes
};

// Thread-safe. The same for any tiling of the map. Start and goal are snapped to nodes; kNoStart and kNoGoal say that
// none is near, for places that are no numbers, too. Throws what loading tiles throws.
Route find_route(const TraversalGraph& graph, Place start, Place goal, const RouteRules& rules = {});

}  // namespace btms
