// The surface of a map as binary glTF 2.0 (.glb), for Blender, engines and browsers: one mesh of triangles with normals
// and colours of the states. glTF's y is up: x is east, y up, z south, metres from a local origin, which
// asset.extras.origin_m names together with reference system, revision and digest of the map.
#pragma once

#include <filesystem>

#include "io/export/surface_mesh.h"
#include "io/store/map_store.h"

namespace btms {

// As write_ply_mesh(); also Error(kUsage) for more than the 4 GiB that a .glb can hold.
MeshSize write_glb_mesh(const MapReader& map, const TileSource& tiles, int level, const CellBox& box,
                        const std::filesystem::path& path);

}  // namespace btms
