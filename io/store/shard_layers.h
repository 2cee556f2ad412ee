// The layers of a shard as HDF5 has them. Everything here reads bytes that may be anybody's; what a terrain tile makes
// of the rasters (shard_file.h) is plain arrays.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "io/crs/crs.h"
#include "io/store/layers.h"

namespace btms {

// A shard's bytes, and what the manifest says is in them.
struct StoredShard {
  std::span<const std::uint8_t> bytes;
  std::int32_t resolution_mm = 0;
  CellBox box;
};

enum class Wanted : std::uint8_t {
  kModel,   // the group tgf
  kLabels,  // of it, what labels need
  kAll,     // root layers too; axes and reference system are compared with what a writer writes
};

// Whether a shard with `upper` further surfaces has the layer, and it is wanted.
bool is_read(const LayerInfo& layer, Wanted wanted, std::size_t upper);

// Receives the wanted layers in the order of layer_table(), as stored (little-endian, north first). `upper`: entries of
// the lists, the same in every call.
using LayerSink = std::function<void(const LayerInfo& layer, std::size_t upper, std::vector<std::uint8_t>&& raster)>;

// Throws Error(kVerification) when the bytes are not a shard over the box; the shapes of all layers are compared, and
// the order of the lists, before the first sink() call. `crs` is for kAll. Not safe against bytes made with intent:
// see sandboxed_layers.h.
void read_layers(const StoredShard& shard, Wanted wanted, const std::optional<Crs>& crs, const LayerSink& sink);

}  // namespace btms
