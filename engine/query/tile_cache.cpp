#include "engine/query/tile_cache.h"

#include <algorithm>
#include <bit>
#include <string>

#include "engine/error.h"

namespace btms {

std::size_t memory_bytes(const TerrainTile& tile) {
  const auto bytes = [](const auto& buffer) { return buffer.capacity() * sizeof buffer[0]; };
  return sizeof tile + bytes(tile.corner_mm) + bytes(tile.centre_mm) + bytes(tile.nodes) + bytes(tile.upper);
}

TileCache::TileCache(std::shared_ptr<const TileSource> map, std::size_t budget_bytes)
    : map_(std::move(map)), budget_bytes_(budget_bytes) {
  const std::vector<TileId> ids = map_->tiles();
  slot_count_ = ids.size();
  slots_ = std::make_unique<Slot[]>(slot_count_);
  held_.reserve(slot_count_);  // so that neither list can fail to grow
  graveyard_.reserve(slot_count_);
  table_.assign(std::bit_ceil(2 * slot_count_ + 2), 0);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    slots_[i].id = ids[i];
    std::size_t at = TileIdHash()(ids[i]) >> 7;
    while (table_[at & (table_.size() - 1)] != 0) ++at;
    table_[at & (table_.size() - 1)] = static_cast<std::uint32_t>(i + 1);
  }
}

TileCache::~TileCache() {
  for (std::size_t i = 0; i < slot_count_; ++i) delete slots_[i].loaded.load(std::memory_order_relaxed);
}

TileCache::Slot* TileCache::find(TileId id) const {
  for (std::size_t at = TileIdHash()(id) >> 7;; ++at) {
    const std::uint32_t index = table_[at & (table_.size() - 1)];
    if (index == 0) return nullptr;
    if (slots_[index - 1].id == id) return &slots_[index - 1];
  }
}

// The evictor takes the pointer away first and looks for readers then, a reader counts itself in first and looks at
// the pointer then, all in one total order: so one of the two sees the other.
TileCache::Pin TileCache::count_in(Slot& slot) const noexcept {
  slot.readers.fetch_add(1, std::memory_order_seq_cst);
  const Loaded* loaded = slot.loaded.load(std::memory_order_seq_cst);
  if (!loaded) {
    slot.readers.fetch_sub(1, std::memory_order_release);
    return {};
  }
  if (!slot.used.load(std::memory_order_relaxed)) slot.used.store(true, std::memory_order_relaxed);
  return {&slot, loaded};
}

TileCache::Pin TileCache::pin(TileId id) const {
  Slot* slot = find(id);
  if (!slot) return {};
  if (Pin pin = count_in(*slot)) return pin;
  if (slot->damaged.load(std::memory_order_relaxed))
    throw Error(ErrorCode::kVerification, "tile " + std::to_string(id.tx) + "," + std::to_string(id.ty) +
                                              " could not be read; `btms verify` says why");
  return load_into(*slot);
}

TileCache::Pin TileCache::try_pin(TileId id) const noexcept {
  Slot* slot = find(id);
  if (!slot) return {};
  if (Pin pin = count_in(*slot)) return pin;
  try {
    if (!slot->damaged.load(std::memory_order_relaxed)) return load_into(*slot);
  } catch (...) {
  }
  Pin none;
  none.damaged_ = true;
  return none;
}

std::shared_ptr<const TerrainTile> TileCache::load(TileId id) const {
  Slot* slot = find(id);
  if (!slot) return nullptr;
  Pin pin = count_in(*slot);
  if (!pin) pin = load_into(*slot);
  return pin.loaded_->tile;
}

TileCache::Pin TileCache::load_into(Slot& slot) const {
  const std::lock_guard loading(loading_[static_cast<std::size_t>(&slot - slots_.get()) % kLoadLocks]);
  if (Pin pin = count_in(slot)) return pin;  // another thread was faster
  {
    const std::lock_guard lock(mutex_);
    const auto grave =
        std::find_if(graveyard_.begin(), graveyard_.end(), [&](const Evicted& e) { return e.slot == &slot; });
    if (grave != graveyard_.end()) {
      std::unique_ptr<const Loaded> back = std::move(grave->loaded);
      graveyard_.erase(grave);
      return hold(slot, std::move(back));
    }
  }
  std::unique_ptr<const Loaded> loaded = read(slot);
  const std::lock_guard lock(mutex_);
  ++counts_.loads;
  return hold(slot, std::move(loaded));
}

std::unique_ptr<const TileCache::Loaded> TileCache::read(Slot& slot) const {
  auto loaded = std::make_unique<Loaded>();
  try {
    loaded->tile = map_->load(slot.id);
    if (!loaded->tile) throw Error(ErrorCode::kVerification, "a tile that the map lists is not there");
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kVerification) slot.damaged.store(true, std::memory_order_relaxed);
    throw;
  }
  slot.damaged.store(false, std::memory_order_relaxed);
  loaded->bytes = memory_bytes(*loaded->tile);
  return loaded;
}

TileCache::Pin TileCache::hold(Slot& slot, std::unique_ptr<const Loaded> loaded) const {
  held_.push_back(&slot);
  counts_.bytes += loaded->bytes;
  slot.readers.fetch_add(1, std::memory_order_seq_cst);
  Pin pin(&slot, loaded.get());
  slot.used.store(true, std::memory_order_relaxed);
  slot.loaded.store(loaded.release(), std::memory_order_seq_cst);
  make_room(slot);
  return pin;
}

// Second chance: what was used since the hand came by stays once more.
void TileCache::make_room(const Slot& newest) const {
  for (std::size_t looked = 0; counts_.bytes > budget_bytes_ && held_.size() > 1; ++looked) {
    hand_ = hand_ % held_.size();
    Slot& slot = *held_[hand_];
    const bool used = slot.used.exchange(false, std::memory_order_relaxed) && looked < 2 * held_.size();
    if (&slot == &newest || used) {
      ++hand_;
      continue;
    }
    graveyard_.push_back({&slot, nullptr});
    graveyard_.back().loaded.reset(slot.loaded.exchange(nullptr, std::memory_order_seq_cst));
    counts_.bytes -= graveyard_.back().loaded->bytes;
    ++counts_.evictions;
    held_[hand_] = held_.back();
    held_.pop_back();
  }
  std::erase_if(graveyard_, [](const Evicted& e) { return e.slot->readers.load(std::memory_order_seq_cst) == 0; });
}

TileCache::Counts TileCache::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace btms
