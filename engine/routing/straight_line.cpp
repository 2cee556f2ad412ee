#include "engine/routing/straight_line.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace btms {
namespace {

// In squares, from the corner A of a cell near the line: doubles then are exact to a nanometre.
struct Spot {
  double u = 0, v = 0;
};

// Where the line crosses one family of parallel edges, which lie at whole values of s: as shares of the line.
void add_crossings(double s0, double s1, std::vector<double>& shares) {
  if (s0 == s1) return;
  const double low = std::min(s0, s1), high = std::max(s0, s1);
  for (double s = std::floor(low) + 1; s < high; ++s) shares.push_back((s - s0) / (s1 - s0));
}

NodeId node_at(Spot spot, Cell origin) {
  const double col = std::floor(spot.u), row = std::floor(spot.v);
  const double x = spot.u - col - 0.5, y = spot.v - row - 0.5;
  const unsigned p = x + y < 0, q = x - y < 0;
  return {{origin.col + static_cast<std::int32_t>(col), origin.row + static_cast<std::int32_t>(row)},
          static_cast<std::uint8_t>(2 * p | (p ^ q))};
}

bool joined(const TileGraph& graph, NodeId from, NodeId to) {
  const GraphNode* node = graph.find(from);
  for (std::size_t n = 0; n < kNeighbours; ++n) {
    const NodeOffset& o = kNeighbourTable[from.triangle][n];
    if (NodeId{{from.cell.col + o.col, from.cell.row + o.row}, o.triangle} == to) return (node->edges >> n & 1) != 0;
  }
  return false;
}

}  // namespace

std::optional<LineOnGraph> straight_line(GraphReader& graph, Place from, Place to, double cost_weight) {
  const Lattice& lattice = graph.layout().lattice;
  const double r_m = lattice.resolution_m();
  const Cell origin = lattice.cell_at(static_cast<std::int64_t>(std::floor(from.x_m * 1000)),
                                      static_cast<std::int64_t>(std::floor(from.y_m * 1000)));
  const auto spot = [&](Place p) { return Spot{(p.x_m - origin.col * r_m) / r_m, (p.y_m - origin.row * r_m) / r_m}; };
  const Spot a = spot(from), b = spot(to);
  std::vector<double> shares = {0, 1};
  add_crossings(a.u, b.u, shares);
  add_crossings(a.v, b.v, shares);
  add_crossings(a.u + a.v, b.u + b.v, shares);
  add_crossings(a.u - a.v, b.u - b.v, shares);
  std::sort(shares.begin(), shares.end());

  const double du = b.u - a.u, dv = b.v - a.v, length_r = std::sqrt(du * du + dv * dv);
  LineOnGraph line;
  std::optional<NodeId> before;
  constexpr double kNothing = 1e-9;  // shorter pieces are where edges meet
  for (std::size_t i = 0; i + 1 < shares.size(); ++i) {
    const double run_r = (shares[i + 1] - shares[i]) * length_r;
    if (run_r < kNothing) continue;
    const double middle = (shares[i] + shares[i + 1]) / 2;
    const NodeId id = node_at({a.u + middle * du, a.v + middle * dv}, origin);
    const GraphNode* node = graph.find(id);
    if (!node) return {};
    if (before && *before != id && !joined(*graph.at(before->cell), *before, id)) line.joined = false;
    before = id;
    const double run_m = run_r * r_m;
    const double slope = (node->rise_x_mm * du + node->rise_y_mm * dv) / (length_r * lattice.resolution_mm());
    const double length_m = run_m * std::sqrt(1 + slope * slope);
    line.length_m += length_m;
    line.weight += length_m * (1 + cost_weight * node->cost / 254.0);
    line.steepest = std::max(line.steepest, std::abs(slope));
  }
  return line;
}

}  // namespace btms
