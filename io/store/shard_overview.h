// What a shard shows from afar: its values on the coarse levels (engine/model/tile_samples.h), stored behind its
// chunks, so that the whole of a large map is seen without decoding all of it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/model/tile_samples.h"

namespace btms {

// Finer levels come from the tiles themselves: they have few below one served tile.
inline constexpr int kFirstOverview = 3;

class ShardOverview {
 public:
  // Of a shard's content.
  explicit ShardOverview(const TerrainTile& tile);
  // What stored() returned. Throws Error(kVerification) when it is not the overview of a shard over the box.
  ShardOverview(const CellBox& box, std::span<const std::uint8_t> stored);

  // One chunk of float32: levels from kFirstOverview to kMaxLevel, of each all layers of raster_layers(), of each the
  // squares from south to north. Empty where no square's centre lies in the shard.
  std::vector<std::uint8_t> stored() const;

  // To the bit.
  bool is_same(const ShardOverview& other) const;

  // Preconditions: level >= kFirstOverview; the square is one of squares_sampled_in() the shard's box.
  float at(std::size_t layer, Cell square, int level) const;

 private:
  explicit ShardOverview(const CellBox& box);
  CellBox box_;
  std::vector<std::size_t> first_;  // of each level: its first value
  std::vector<float> values_;
};

}  // namespace btms
