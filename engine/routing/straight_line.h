// What a vehicle that drives straight from one place to another meets.
#pragma once

#include <optional>

#include "engine/query/place.h"
#include "engine/routing/graph_reader.h"

namespace btms {

// A straight line over nodes of the graph. Metres.
struct LineOnGraph {
  double length_m = 0;  // over the surface
  double weight = 0;    // every metre weighed with the cost c of its node, 1 + cost_weight c
  double steepest = 0;  // rise per run, up or down
  bool joined = true;   // every node on it with the next
};

// Nothing where the line leaves the nodes. Precondition: both places
// lie on nodes.
std::optional<LineOnGraph> straight_line(GraphReader& graph, Place from, Place to, double cost_weight);

}  // namespace btms
