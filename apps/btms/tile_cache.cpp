#include "apps/btms/tile_cache.h"

namespace btms {

std::shared_ptr<const TerrainTile> TileCache::load(TileId id) const {
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = at_.find(id); found != at_.end()) {
      recent_.splice(recent_.begin(), recent_, found->second);
      return found->second->second;
    }
  }
  auto tile = map_.load(id);
  const std::lock_guard lock(mutex_);
  if (at_.contains(id)) return tile;  // another thread was faster
  recent_.emplace_front(id, tile);
  at_.emplace(id, recent_.begin());
  if (recent_.size() > capacity_) {
    at_.erase(recent_.back().first);
    recent_.pop_back();
  }
  return tile;
}

}  // namespace btms
