#include <algorithm>
#include <limits>
#include <list>
#include <mutex>
#include <type_traits>
#include <unordered_map>

#include "engine/error.h"
#include "io/store/chunk_codec.h"
#include "io/store/chunk_index.h"
#include "io/store/map_folder.h"
#include "io/store/sandboxed_layers.h"
#include "io/store/shard_assembly.h"
#include "io/store/shard_file.h"
#include "io/store/shard_overview.h"

namespace btms {
namespace {

namespace fs = std::filesystem;
using SharedTile = std::shared_ptr<const TerrainTile>;

// The decoded shards used last. A shard that several threads ask for is decoded once, the others wait for it.
class ShardCache {
 public:
  template <class Decode>
  SharedTile get(std::size_t shard, Decode&& decode) {
    const std::shared_ptr<Slot> slot = find(shard);
    const std::lock_guard lock(slot->mutex);
    if (!slot->tile) slot->tile = decode();
    return slot->tile;
  }

 private:
  static constexpr std::size_t kShards = 4;
  struct Slot {
    std::size_t shard = 0;
    std::mutex mutex;  // held while decoding
    SharedTile tile;
  };

  std::shared_ptr<Slot> find(std::size_t shard) {
    const std::lock_guard lock(mutex_);
    auto it = std::find_if(slots_.begin(), slots_.end(), [&](const auto& s) { return s->shard == shard; });
    if (it == slots_.end()) {
      if (slots_.size() == kShards) slots_.pop_back();
      slots_.push_front(std::make_shared<Slot>());
      slots_.front()->shard = shard;
    } else {
      slots_.splice(slots_.begin(), slots_, it);
    }
    return slots_.front();
  }

  std::mutex mutex_;
  std::list<std::shared_ptr<Slot>> slots_;  // last used first
};

// Throws Error(kVerification).
std::vector<float> decoded_values(const StoredRaster& raster) {
  constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> values(static_cast<std::size_t>(raster.box.cells()), kNothing);
  if (raster.bytes.empty()) return values;
  const auto decode = [&](std::span<std::uint8_t> into) {
    if (!ChunkDecoder().decode(raster.bytes, raster.element_bytes, into)) damaged_shard("a layer of it is damaged");
  };
  if (raster.element_bytes == sizeof(float)) {
    decode({reinterpret_cast<std::uint8_t*>(values.data()), values.size() * sizeof(float)});
    return values;
  }
  std::vector<std::uint8_t> bytes(values.size());
  decode(bytes);
  std::transform(bytes.begin(), bytes.end(), values.begin(), [](std::uint8_t v) { return v == 255 ? kNothing : v; });
  return values;
}

class FolderReader final : public MapReader {
 public:
  FolderReader(const fs::path& folder, Manifest&& manifest, Trust trust)
      : folder_(folder),
        manifest_(std::move(manifest)),
        trusted_(trust == Trust::kTrusted),
        reading_(trusted_ ? read_layers : read_layers_sandboxed) {
    for (std::size_t s = 0; s < manifest_.shards.size(); ++s)
      for (const TileEntry& t : manifest_.shards[s].tiles) where_.emplace(t.id, Place{s, t.box});
  }

  const MapInfo& info() const override { return manifest_.info; }
  const MapLayout& layout() const override { return manifest_.info.layout; }

  std::span<const ShardEntry> shards() const override { return manifest_.shards; }

  std::optional<ShardOverview> overview(const ShardEntry& shard) const override {
    if (!trusted_) return {};
    return guarded(shard, shard.tiles.front().id, [&]() -> std::optional<ShardOverview> {
      const auto stored = read_overview(file_of(shard));
      if (!stored) return {};
      return ShardOverview(shard.bounds(), *stored);
    });
  }

  std::optional<StoredRaster> stored_raster(TileId id, std::string_view name) const override {
    const auto it = where_.find(id);
    if (!trusted_ || it == where_.end()) return {};
    const ShardEntry& shard = manifest_.shards[it->second.shard];
    const CellBox box = shard.bounds();
    const auto table = layer_table();
    const auto layer =
        std::find_if(table.begin(), table.end(), [&](const LayerInfo& l) { return !l.in_tgf && l.name == name; });
    if (shard.tiles.size() != 1 || layer_shape(*layer, box, 0) != chunk_shape(*layer, box, 0)) return {};
    return guarded(shard, id, [&]() -> std::optional<StoredRaster> {
      auto stored = read_chunk(file_of(shard), box, *layer, 0, 0);
      if (!stored) return {};
      return StoredRaster{box, element_bytes(layer->element), std::move(*stored)};
    });
  }

  std::optional<LayerValues> layer_values(TileId id, std::string_view name) const override {
    const std::optional<StoredRaster> stored = stored_raster(id, name);
    if (!stored) return {};
    const ShardEntry& shard = manifest_.shards[where_.at(id).shard];
    return guarded(shard, id, [&]() -> LayerValues { return {stored->box, decoded_values(*stored)}; });
  }

  std::vector<TileId> tiles() const override {
    std::vector<TileId> ids;
    ids.reserve(where_.size());
    for (const auto& entry : where_) ids.push_back(entry.first);
    std::sort(ids.begin(), ids.end());
    return ids;
  }

  SharedTile load(TileId id) const override {
    return load(id, cache_, [this](const ShardEntry& shard, std::span<const std::uint8_t> bytes) {
      return decode_shard(stored(shard, bytes), shard.values_xxh3, reading_);
    });
  }

  SharedTile load_for_labels(TileId id) const override {
    return load(id, label_cache_, [this](const ShardEntry& shard, std::span<const std::uint8_t> bytes) {
      return decode_shard_for_labels(stored(shard, bytes), reading_);
    });
  }

 private:
  struct Place {
    std::size_t shard;
    CellBox box;
  };

  IndexedFile file_of(const ShardEntry& shard) const {
    return {folder_ / kShardFolder / shard.file, shard.bytes, shard.values_xxh3};
  }

  StoredShard stored(const ShardEntry& shard, std::span<const std::uint8_t> bytes) const {
    return {bytes, layout().lattice.resolution_mm(), shard.bounds()};
  }

  template <class Decode>
  SharedTile load(TileId id, ShardCache& cache, const Decode& decode) const {
    const auto it = where_.find(id);
    if (it == where_.end()) return nullptr;
    const Place& place = it->second;
    const ShardEntry& shard = manifest_.shards[place.shard];
    const SharedTile whole = cache.get(place.shard, [&] { return read(shard, id, decode); });
    if (whole->box == place.box) return whole;
    return std::make_shared<const TerrainTile>(cut(*whole, place.box));
  }

  template <class Decode>
  SharedTile read(const ShardEntry& shard, TileId id, const Decode& decode) const {
    return guarded(shard, id,
                   [&] { return std::make_shared<const TerrainTile>(decode(shard, read_shard(folder_, shard))); });
  }

  // What work() returns; damage names file and tile.
  template <class Work>
  std::invoke_result_t<Work> guarded(const ShardEntry& shard, TileId id, const Work& work) const {
    try {
      return work();
    } catch (const Error& e) {
      if (e.code() != ErrorCode::kVerification) throw;
      throw Error(e.code(), "tile " + std::to_string(id.tx) + "," + std::to_string(id.ty) + " is damaged: " + e.what(),
                  (folder_ / kShardFolder / shard.file).string());
    }
  }

  const fs::path folder_;
  const Manifest manifest_;
  const bool trusted_;
  const LayerReading reading_;
  std::unordered_map<TileId, Place, TileIdHash> where_;
  mutable ShardCache cache_, label_cache_;
};

}  // namespace

std::unique_ptr<MapReader> MapReader::open(const fs::path& folder, Trust trust) {
  return open(folder, read_manifest(folder), trust);
}

std::unique_ptr<MapReader> MapReader::open(const fs::path& folder, Manifest manifest, Trust trust) {
  return std::make_unique<FolderReader>(folder, std::move(manifest), trust);
}

}  // namespace btms
