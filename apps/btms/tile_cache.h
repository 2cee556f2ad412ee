// Keeps the tiles of a map that were asked for last, because a map on disk decodes a tile at every load().
#pragma once

#include <list>
#include <mutex>
#include <unordered_map>
#include <utility>

#include "engine/model/tile_store.h"

namespace btms {

// Thread-safe. The map must outlive it.
class TileCache final : public TileSource {
 public:
  explicit TileCache(const TileSource& map, std::size_t tiles = 256) : map_(map), capacity_(tiles) {}

  const MapLayout& layout() const override { return map_.layout(); }
  std::vector<TileId> tiles() const override { return map_.tiles(); }
  std::shared_ptr<const TerrainTile> load(TileId id) const override;

 private:
  using Entry = std::pair<TileId, std::shared_ptr<const TerrainTile>>;

  const TileSource& map_;
  const std::size_t capacity_;
  mutable std::mutex mutex_;         // guards what follows; loading happens outside it
  mutable std::list<Entry> recent_;  // the last used first; places without a tile are kept too, as nullptr
  mutable std::unordered_map<TileId, std::list<Entry>::iterator, TileIdHash> at_;
};

}  // namespace btms
