// The ground as a point cloud in tiles, as Autoware's map loader takes it: a folder of binary PCD files, a text beside
// it that says where each begins. Points are samples of the surface, one at the centre of every square of a raster: x,
// y, z as float32 metres.
#pragma once

#include <cstdint>
#include <filesystem>

#include "io/export/map_raster.h"
#include "io/store/map_store.h"

namespace btms {

struct PcdTilesSize {
  std::uint64_t files = 0, points = 0, bytes = 0;
  double origin_x_m = 0, origin_y_m = 0;  // to be added to x and y
};

// Folder and text must not exist; both take their names when they are complete, the folder first. Tiles are `tile_m`
// wide from whole multiples of it. Where the map lies beyond 100 km from 0, coordinates are those in its square of
// 100 km, as Autoware's MGRS projector has them: a float32 would have steps of up to half a metre there. Throws
// Error(kUsage) for an edge that is not a multiple of the raster's squares or holds more than 2^24 of them, or when
// there is no surface; Error(kFailed), what read_part() throws.
PcdTilesSize write_pcd_tiles(const MapReader& map, const TileSource& tiles, const RasterFrame& frame, double tile_m,
                             const std::filesystem::path& folder);
// pointcloud_map_metadata.yaml beside `folder`.
std::filesystem::path pcd_metadata_of(const std::filesystem::path& folder);

}  // namespace btms
