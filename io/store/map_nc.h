// map.nc: one CF/NetCDF-4 file whose virtual datasets show the shards of a revision as one raster.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/crs/crs.h"
#include "io/store/manifest.h"

namespace btms {

// Longest side map.nc can have: its axes are written out in full.
inline constexpr std::int64_t kMaxMapSide_cells = std::int64_t{1} << 23;

// The bytes of map.nc, which names shards relative to itself; nothing when the map is empty or too long (see above).
std::vector<std::uint8_t> encode_map_nc(std::int32_t resolution_mm, const std::vector<ShardEntry>& shards,
                                        const std::optional<Crs>& crs);

}  // namespace btms
