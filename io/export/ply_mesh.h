// The surface of a map as binary PLY: vertices (float32 x, y, z in metres from a local origin, unit normal, colour of
// the state, state) and triangles. The origin, to be added to x and y, and the reference system are comments.
#pragma once

#include <filesystem>

#include "io/export/surface_mesh.h"
#include "io/store/map_store.h"

namespace btms {

// Box and level as in surface_mesh.h; `tiles` are those of `map`. Throws what its functions throw, Error(kFailed).
MeshSize write_ply_mesh(const MapReader& map, const TileSource& tiles, int level, const CellBox& box,
                        const std::filesystem::path& path);

}  // namespace btms
