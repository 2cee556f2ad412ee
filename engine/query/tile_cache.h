// The tiles of a map that were asked for last, within a budget of bytes: a map on disk decodes a tile at every load().
//
// A revision's tiles are a fixed list, so every tile has a slot of its own. Readers of a tile that is there take no
// lock and allocate nothing: they count themselves in, read the slot's pointer, and count themselves out. What is
// evicted is freed when nobody is counted in; asked for before that, it comes back, so a tile is never held twice.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "engine/model/tile_store.h"

namespace btms {

// Bytes a tile takes in memory.
std::size_t memory_bytes(const TerrainTile& tile);

inline constexpr std::size_t kDefaultCache_bytes = std::size_t{256} << 20;

// Thread-safe.
class TileCache final : public TileSource {
  struct Loaded {
    std::shared_ptr<const TerrainTile> tile;
    std::size_t bytes = 0;
  };
  struct Slot {
    TileId id;
    std::atomic<const Loaded*> loaded{nullptr};
    std::atomic<std::uint32_t> readers{0};
    std::atomic<bool> used{false};     // since the evictor was here
    std::atomic<bool> damaged{false};  // it could not be read, and is not tried again by pin()
  };

 public:
  // At least one tile is kept whatever the budget.
  explicit TileCache(std::shared_ptr<const TileSource> map, std::size_t budget_bytes = kDefaultCache_bytes);
  ~TileCache() override;
  TileCache(const TileCache&) = delete;
  TileCache& operator=(const TileCache&) = delete;

  // Keeps a tile in memory while it lives. Hold it for as long as a few places take, not for a session: use load().
  class Pin {
   public:
    Pin() = default;
    Pin(Pin&& o) noexcept
        : slot_(std::exchange(o.slot_, nullptr)), loaded_(std::exchange(o.loaded_, nullptr)), damaged_(o.damaged_) {}
    Pin& operator=(Pin&& o) noexcept {
      std::swap(slot_, o.slot_);
      std::swap(loaded_, o.loaded_);
      damaged_ = o.damaged_;
      return *this;
    }
    ~Pin() {
      if (slot_) slot_->readers.fetch_sub(1, std::memory_order_release);
    }
    // nullptr where the map has no such tile, or try_pin() could not read it.
    const TerrainTile* get() const { return loaded_ ? loaded_->tile.get() : nullptr; }
    const TerrainTile& operator*() const { return *loaded_->tile; }
    const TerrainTile* operator->() const { return loaded_->tile.get(); }
    explicit operator bool() const { return loaded_ != nullptr; }
    bool damaged() const { return damaged_; }

   private:
    friend TileCache;
    Pin(Slot* slot, const Loaded* loaded) : slot_(slot), loaded_(loaded) {}
    Slot* slot_ = nullptr;
    const Loaded* loaded_ = nullptr;
    bool damaged_ = false;
  };
  // Throws what loading throws; Error(kVerification) at once when a tile could not be read before.
  Pin pin(TileId id) const;
  // An empty pin that is damaged() instead.
  Pin try_pin(TileId id) const noexcept;

  // Whether there is a tile, without loading it.
  bool contains(TileId id) const { return find(id) != nullptr; }

  const MapLayout& layout() const override { return map_->layout(); }
  std::vector<TileId> tiles() const override { return map_->tiles(); }
  // Tries a tile again that could not be read.
  std::shared_ptr<const TerrainTile> load(TileId id) const override;
  std::shared_ptr<const TerrainTile> load_for_labels(TileId id) const override { return map_->load_for_labels(id); }

  struct Counts {
    std::uint64_t loads = 0, evictions = 0;
    std::size_t bytes = 0;  // held; what pins and shared pointers keep beyond that is theirs
  };
  Counts counts() const;

 private:
  Slot* find(TileId id) const;
  Pin count_in(Slot& slot) const noexcept;
  Pin load_into(Slot& slot) const;
  std::unique_ptr<const Loaded> read(Slot& slot) const;
  Pin hold(Slot& slot, std::unique_ptr<const Loaded> loaded) const;  // mutex_ is locked
  void make_room(const Slot& newest) const;

  const std::shared_ptr<const TileSource> map_;
  const std::size_t budget_bytes_;
  std::size_t slot_count_ = 0;
  std::unique_ptr<Slot[]> slots_;
  std::vector<std::uint32_t> table_;  // open addressing: 1 + index of a slot; 0 is free

  static constexpr std::size_t kLoadLocks = 64;
  mutable std::mutex loading_[kLoadLocks];  // of a slot's tile; a tile is loaded once

  struct Evicted {
    Slot* slot;
    std::unique_ptr<const Loaded> loaded;
  };
  mutable std::mutex mutex_;                // guards what follows
  mutable std::vector<Evicted> graveyard_;  // evicted, but not known to be read by nobody
  mutable std::size_t hand_ = 0;            // where the evictor looks next
  mutable std::vector<Slot*> held_;
  mutable Counts counts_;
};

}  // namespace btms
