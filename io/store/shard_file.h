// One shard: a TerrainTile over the hull of the shard's tiles, as the bytes of a CF/NetCDF-4 file, and back.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "engine/model/terrain_tile.h"
#include "io/store/shard_layers.h"

namespace btms {

struct EncodedShard {
  std::vector<std::uint8_t> file;
  std::uint64_t values_xxh3 = 0;  // of the decoded tgf layers, in the order of layer_table()
};

// Compresses in the calling thread; only short HDF5 calls share the library's lock. Throws Error(kFailed).
EncodedShard encode_shard(const TerrainTile& tile, const std::optional<Crs>& crs);

// Who reads the layers: read_layers() itself, or somebody who runs it behind a fence.
using LayerReading = std::function<void(const StoredShard&, Wanted, const std::optional<Crs>&, const LayerSink&)>;

// Throws Error(kVerification) when the bytes are not a shard over the box, or its values hash differently.
TerrainTile decode_shard(const StoredShard& shard, std::uint64_t values_xxh3, const LayerReading& read = read_layers);
// The same for heights, states and thresholds alone; the rest of the tile has its defaults. The hash of all values
// can't be checked then: the caller's of the file has to do.
TerrainTile decode_shard_for_labels(const StoredShard& shard, const LayerReading& read = read_layers);
// decode_shard(), and everything else in the file is what encode_shard() would have written of that tile: root layers,
// axes, reference system; nodes with a surface have heights.
TerrainTile check_shard(const StoredShard& shard, std::uint64_t values_xxh3, const std::optional<Crs>& crs,
                        const LayerReading& read = read_layers);

}  // namespace btms
