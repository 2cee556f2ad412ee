// One shard: a TerrainTile over the hull of the shard's tiles, as the bytes of a CF/NetCDF-4 file, and back.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/model/terrain_tile.h"
#include "io/store/crs.h"

namespace btms {

struct EncodedShard {
  std::vector<std::uint8_t> file;
  std::uint64_t values_xxh3 = 0;  // of the decoded tgf layers, in the order of layer_table()
};

// Compresses in the calling thread; only short HDF5 calls share the library's lock. Throws Error(kFailed).
EncodedShard encode_shard(const TerrainTile& tile, const std::optional<Crs>& crs);

// Throws Error(kVerification) when the bytes are not a shard over `box`, or its values hash differently.
TerrainTile decode_shard(std::span<const std::uint8_t> file, std::int32_t resolution_mm, const CellBox& box,
                         std::uint64_t values_xxh3);
// The same for heights, states and thresholds alone; the rest of the tile has its defaults. The hash of all values
// can't be checked then: the caller's of the file has to do.
TerrainTile decode_shard_for_labels(std::span<const std::uint8_t> bytes, std::int32_t resolution_mm,
                                    const CellBox& box);

}  // namespace btms
