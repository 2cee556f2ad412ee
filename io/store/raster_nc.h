// A part of a map as one CF/NetCDF-4 file, which is HDF5, too: for xarray, ncdump, GDAL, h5py; no link leads out of it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "engine/lattice/tiles.h"
#include "io/crs/crs.h"

namespace btms {

struct RasterValues {
  std::string_view layer;         // of the root of a shard: "elevation" ...
  std::span<const float> values;  // rows from north to south, NaN where there is nothing
};

// The bytes of the file, with attributes and types as shards have them. `box` in squares of `edge_mm`, an even number.
// Throws Error(kFailed). Preconditions: layers of that name, values for every square of the box.
std::vector<std::uint8_t> encode_raster_nc(const CellBox& box, std::int32_t edge_mm, const std::optional<Crs>& crs,
                                           std::span<const RasterValues> layers);

}  // namespace btms
