// A finished map held in memory: sink while it is built, source afterwards.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "engine/model/tile_store.h"

namespace btms {

class MemoryMap final : public TileSink, public TileSource {
 public:
  MemoryMap() = default;
  explicit MemoryMap(const MapLayout& layout) : layout_(layout) {}
  MemoryMap(MemoryMap&& o) noexcept : layout_(o.layout_), tiles_(std::move(o.tiles_)) {}
  MemoryMap& operator=(MemoryMap&& o) noexcept {
    layout_ = o.layout_;
    tiles_ = std::move(o.tiles_);
    return *this;
  }

  Digest put(TileId id, TerrainTile&& tile) override {
    const Digest kept = digest(tile);
    auto shared = std::make_shared<const TerrainTile>(std::move(tile));
    const std::lock_guard lock(mutex_);
    tiles_.emplace(id, std::move(shared));
    return kept;
  }

  const MapLayout& layout() const override { return layout_; }
  std::vector<TileId> tiles() const override {
    std::vector<TileId> ids;
    for (const auto& entry : tiles_) ids.push_back(entry.first);
    return ids;
  }
  std::shared_ptr<const TerrainTile> load(TileId id) const override {
    const auto it = tiles_.find(id);
    return it == tiles_.end() ? nullptr : it->second;
  }

 private:
  MapLayout layout_;
  std::mutex mutex_;  // guards tiles_ while building; reading starts when building has ended
  std::map<TileId, std::shared_ptr<const TerrainTile>> tiles_;
};

}  // namespace btms
