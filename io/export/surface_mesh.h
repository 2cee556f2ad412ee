// The surface of a map as triangles. Squares of level L are 2^L squares of the map wide, from absolute multiples of
// their edge, each cut by its diagonals as the map's own are (engine/lattice/lattice.h): on level 0 the triangles are
// the nodes of the map that have a surface, on coarser levels those whose three corners have one. Every vertex is a
// corner of the map's own lattice, or a square's centre on level 0, at the height of the surface there.
//
// A vertex that squares share is there once, on both sides of tiles and blocks: the mesh has no seams.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>

#include "engine/lattice/tiles.h"
#include "engine/model/tile_store.h"

namespace btms {

struct MeshVertex {
  std::int64_t x_mm = 0, y_mm = 0;
  std::int32_t z_mm = 0;
  std::array<float, 3> normal{};          // unit, up: of the mean slope of the triangles around it
  NodeState state = NodeState::kUnknown;  // most of the map's nodes around it; of equally many the later in the enum
};
using MeshTriangle = std::array<std::uint32_t, 3>;  // vertices in the order they came, counter-clockwise from above

// What a mesh consists of, a piece at a time: vertices, then triangles that name them or earlier ones.
using MeshSink = std::function<void(std::span<const MeshVertex>, std::span<const MeshTriangle>)>;

// Goes through squares of `box` (of the level) once, block by block, south to north. Memory holds one block, the ends
// of the blocks to the south, and what `map` keeps; tiles near the borders of blocks are loaded more than once. The
// pieces depend on the map alone. Throws what load() throws, Error(kUsage) for more than 2^31 - 1 vertices.
void walk_surface(const TileSource& map, int level, const CellBox& box, const MeshSink& sink);

struct MeshSize {
  std::uint64_t vertices = 0, triangles = 0;
  std::array<std::int64_t, 3> min_mm{}, max_mm{};  // of the vertices: x, y, z
};
// By a walk. Throws Error(kUsage) when there is no triangle, too.
MeshSize measure_surface(const TileSource& map, int level, const CellBox& box);

}  // namespace btms
