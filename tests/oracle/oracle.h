// The paper's section II once more, longhand: slow, in long double, without tiles, quantisation or shared code. The
// engine is tested against it. Every block of oracle.cpp carries the number of the equation it spells out.
//
// The engine rounds between its steps (means and heights to mm, normals to 2^-15, weights to 2^-16), the oracle does
// not; so results are compared with tolerances, and decisions only where they are not close to their threshold.
//
// Where the paper leaves a choice, the oracle takes the project's:
//   Eq 5   n(P) >= sigma (printed <=), s_z itself >= cos(theta) (printed cos(z_s))
//   Eq 6   signed product of normals, which goes with eps1; plane distances go with eps2, as the text says
//   B-TGS  connected components of the candidates; components of fewer than keep_nodes nodes are dropped
//   Eq 9   d_xy = 0: the neighbour's own normal
//   Eq 10  normalised; or, in plane mode, a weighted least-squares plane instead of Eq 8-10
//
// Units: metres in the map frame (x east, y north, z up) unless a name says otherwise. Thread-safe: no state.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "engine/terrain/parameters.h"

namespace btms::oracle {

struct Point {
  std::int64_t x_mm = 0, y_mm = 0;
  std::int32_t z_mm = 0;
};

// Same values as btms::Label.
enum class Label : std::uint8_t { kTerrain = 1, kObstacle = 2, kBelow = 3 };

// (row, column, triangle); triangles E, N, W, S = 0..3.
using NodeKeyTuple = std::tuple<std::int64_t, std::int64_t, int>;
// Position of a corner in half cells: (x, y). Square corners are even, centre corners odd.
using CornerKey = std::pair<std::int64_t, std::int64_t>;

inline constexpr long double kUnknown = std::numeric_limits<long double>::quiet_NaN();

struct Node {
  int count = 0;  // all points of the node

  // Observed. mean, normal and weight of a predicted node are those of the prediction.
  bool has_plane = false;
  std::array<long double, 3> mean{};    // m_i
  std::array<long double, 3> normal{};  // s_i, unit, z >= 0
  long double l1 = 0, l2 = 0, l3 = 0;   // eigenvalues, m^2, descending
  long double weight = 0;               // w_i, Eq 3 or Eq 11
  bool candidate = false;               // Eq 5
  bool terrain = false;                 // candidate in a component that was kept

  // Completed.
  bool predicted = false;   // reverted from other to terrain
  long double support = 0;  // sum of k over the terrain nodes within l; 0 for terrain nodes

  // Fitted. Corners: the square's centre, then counter-clockwise; kUnknown where there is none.
  std::array<long double, 3> corner_z{kUnknown, kUnknown, kUnknown};
  bool has_final = false;
  std::array<long double, 3> final_normal{};
  long double final_d = 0;

  // A decision about this node lies so near its threshold that the engine's rounding may turn it: Eq 5, an edge of
  // Eq 6, the reverting of a prediction, or (close_final) the slope of the final plane.
  bool close_call = false;
  bool close_final = false;
};

struct Result {
  std::map<NodeKeyTuple, Node> nodes;        // nodes with points, with support, or with a known corner
  std::map<CornerKey, long double> corners;  // known corners only
  std::vector<Label> labels;                 // one per point
  std::vector<long double> distances;        // signed distance to the final plane per point; kUnknown without one
};

// Precondition: r is a whole even number of millimetres.
Result run(const std::vector<Point>& points, const Parameters& parameters);

// The pieces, for the oracle's own tests.
NodeKeyTuple locate(std::int64_t x_mm, std::int64_t y_mm, std::int64_t r_mm);
std::array<CornerKey, 3> corners_of(const NodeKeyTuple& node);
std::vector<NodeKeyTuple> neighbours_of(const NodeKeyTuple& node);
std::array<long double, 2> centroid_of(const NodeKeyTuple& node, std::int64_t r_mm);
std::int64_t seed_height_mm(const std::vector<std::int64_t>& z_mm);  // robust node model; not empty
long double kernel(long double d, long double l);                    // Eq 7

}  // namespace btms::oracle
