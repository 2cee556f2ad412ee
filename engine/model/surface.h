// Heights of a finished model at a place.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "engine/model/tile_store.h"

namespace btms {

struct SurfacePoint {
  NodeState state = NodeState::kUnknown;
  double z_m = 0;                // height of the surface; meaningless where state is kUnknown
  double normal[3] = {0, 0, 1};  // unit, z > 0
  double sd_m = 0;               // standard deviation of z
  double weight = 0;             // traversability weight in [0, 1]
  double support = 0;            // kernel support of a prediction
  std::uint32_t count = 0;       // points in the node
  double terrain_m = 0;          // points up to this far above z are terrain
  double roughness_m = 0;        // rms distance of the node's terrain points from the surface
  double step_m = 0;             // jump in height of the ground across the node
  double clearance_m = std::numeric_limits<double>::infinity();  // up to the lowest thing seen above
  double cost = std::numeric_limits<double>::infinity();  // of crossing the node, 0 to 1; infinite: not traversable
  double source_resolution_m = 0;                         // edge of the squares that the height comes from
};

// Another surface over (or under) a place: a bridge deck, a gallery, a ceiling.
struct UpperPoint {
  double z_m = 0;
  double normal[3] = {0, 0, 1};  // unit, z > 0
  double sd_m = 0;               // spread of the points about it
  std::uint32_t count = 0;       // points
  UpperKind kind = UpperKind::kDetached;
};

// The surface at x, y (metres in the map frame, rounded to a millimetre): the plane of the node that holds the place.
// kUnknown outside the map and for non-finite coordinates. Thread-safe as far as `map` is.
SurfacePoint surface_at(const TileSource& map, double x_m, double y_m);

// The further surfaces there, in the order of the tile: by their height over the centre of the square.
std::vector<UpperPoint> upper_surfaces_at(const TileSource& map, double x_m, double y_m);

// The same inside one tile, for callers that hold it. Precondition: the tile's box contains the place's cell.
SurfacePoint surface_in(const TerrainTile& tile, std::int64_t x_mm, std::int64_t y_mm);
std::vector<UpperPoint> upper_surfaces_in(const TerrainTile& tile, std::int64_t x_mm, std::int64_t y_mm);

// The same without a list: fn(index, UpperPoint) for each.
UpperPoint upper_point(const UpperNode& upper, std::int64_t dx_mm, std::int64_t dy_mm);  // from its square's centre
template <class Fn>
void for_each_upper_in(const TerrainTile& tile, std::int64_t x_mm, std::int64_t y_mm, const Fn& fn) {
  if (tile.upper.empty()) return;
  const Lattice lattice(tile.resolution_mm);
  const NodeId id = lattice.node_at(x_mm, y_mm);
  const std::size_t node = tile.node_index(id);
  auto it = std::lower_bound(tile.upper.begin(), tile.upper.end(), node,
                             [](const UpperNode& u, std::size_t n) { return u.node < n; });
  for (std::size_t n = 0; it != tile.upper.end() && it->node == node; ++it, ++n)
    fn(n, upper_point(*it, x_mm - lattice.centre_x_mm(id.cell), y_mm - lattice.centre_y_mm(id.cell)));
}

}  // namespace btms
