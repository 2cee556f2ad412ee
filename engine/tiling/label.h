// Labels points against a finished model (paper Eq 14): stream the inputs again, one label per input point, in order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "engine/model/tile_store.h"
#include "engine/terrain/parameters.h"
#include "engine/terrain/segmentation.h"
#include "engine/tiling/executor.h"
#include "engine/tiling/point_source.h"
#include "engine/tiling/progress.h"

namespace btms {

struct LabelCounts {
  std::uint64_t terrain = 0, obstacle = 0, below = 0, dropped = 0;
  std::uint64_t outside = 0;  // obstacles over a place without a final plane
};

// Called with consecutive runs of a source's labels and the block they were worked out from, from several threads, in
// any order; the runs cover every point once. The block's raw records are there where the source has such, and the
// consumer's to change.
using LabelConsumer = std::function<void(std::uint64_t first, std::span<const Label> labels, PointBlock& block)>;

inline constexpr std::size_t kLabelCacheBytes = std::size_t{512} << 20;

// Labels every point of `source`. `map` must be built with `parameters`. Streams: beside a block of points a thread,
// memory holds the tiles used last, `cache_bytes` of them. Throws what source, map or consumer throw.
LabelCounts label_points(const PointSource& source, const TileSource& map, const Parameters& parameters,
                         const Threads& threads, const LabelConsumer& consumer, Progress& progress,
                         std::size_t cache_bytes = kLabelCacheBytes);

}  // namespace btms
