// The cheapest way from one place of a map to another over its traversability graph: A* across tiles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/query/hazard.h"
#include "engine/query/place.h"
#include "engine/routing/graph.h"

namespace btms {

struct RouteRules {
  // A metre over a node of cost c weighs 1 + cost_weight c: at the vehicle's limit (c = 1) as much as so many more on
  // level, even ground. 0: the shortest way; never negative.
  double cost_weight = 4;
  double snap_m = 6;  // how far the nearest node may be from either end
  // A disc of this diameter that goes along the way touches nothing that breaks a limit (footprint.h), whatever its
  // shape. 0: the line itself stays on nodes, no more.
  double width_m = 0;
  VehicleLimits limits;
  std::size_t most_nodes = 4'000'000;               // one search may settle
  std::size_t most_bytes = std::size_t{256} << 20;  // it may remember
  enum class Shape : std::uint8_t {
    kStraightened,  // bends that cost nothing to leave out are left out
    kNodes,         // over every centroid on the way
  } shape = Shape::kStraightened;
};

enum class RouteStatus : std::uint8_t {
  kFound,
  kNoStart,  // no node near `from`, or it is no place
  kNoGoal,   // nor near `to`
  kBlocked,  // no way leads there
  kTooFar,   // none was found within the limits
};
const char* route_status_name(RouteStatus status);  // "found", "no_start", "no_goal", "blocked", "too_far"

struct RoutePoint {
  Place place;
  double z_m = 0;
};

// Metres. Everything but status and settled is empty unless a route was found.
struct Route {
  RouteStatus status = RouteStatus::kBlocked;
  std::vector<RoutePoint> points;  // begins and ends at `from` and `to`, to the millimetre, where nodes lie there and
                                   // lead on; else at the nearest centroids
  double length_m = 0;             // over the surface
  double weight = 0;               // the same, every metre weighed by the cost of its node
  double steepest_deg = 0;         // along the way, up or down
  std::size_t settled = 0;         // nodes settled
};

// The answer depends on the map alone, not on its tiles: of equally good nodes the one with the smaller key goes first.
// The way lies on nodes of the graph all along, whatever its shape. Thread-safe. Throws Error(kVerification) when a
// tile on the way is damaged, Error(kUsage) when width_m is negative or no number; everything else is a status.
Route find_route(const TraversalGraph& graph, Place from, Place to, const RouteRules& rules = {});

}  // namespace btms
