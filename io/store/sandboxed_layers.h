// read_layers() for maps whose author is unknown.
#pragma once

#include "io/store/shard_layers.h"

namespace btms {

// Most squares of a shard that are read so: a few bytes of HDF5 can claim terabytes.
inline constexpr std::int64_t kMostUntrustedCells = std::int64_t{1} << 22;

// As read_layers(), but HDF5 and the decompressor run in a child process (sandbox.h), one a call. The rasters have the
// right sizes; what is in them is the author's. No other thread may be inside HDF5.
void read_layers_sandboxed(const StoredShard& shard, Wanted wanted, const std::optional<Crs>& crs,
                           const LayerSink& sink);

}  // namespace btms
