#include "io/store/map_repair.h"

#include <algorithm>
#include <map>
#include <mutex>

#include "engine/error.h"
#include "io/files/atomic_file.h"
#include "io/files/read_file.h"
#include "io/store/hash.h"
#include "io/store/journal.h"
#include "io/store/map_folder.h"
#include "io/store/publish.h"
#include "io/store/round_files.h"
#include "io/store/sandboxed_layers.h"
#include "io/store/shard_assembly.h"
#include "io/store/shard_file.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

std::optional<Crs> crs_of(const Manifest& manifest) {
  if (manifest.info.crs_wkt.empty()) return {};
  return describe_crs(manifest.info.crs_wkt);
}

}  // namespace

std::optional<TerrainTile> salvage_shard(const fs::path& folder, const Manifest& manifest, std::size_t shard) {
  constexpr std::uint64_t kMostGrown_bytes = 1 << 20;
  const ShardEntry& entry = manifest.shards[shard];
  try {
    const auto bytes =
        read_file(folder / kShardFolder / entry.file, entry.bytes + kMostGrown_bytes, ErrorCode::kVerification);
    TerrainTile content = decode_shard({bytes, manifest.info.layout.lattice.resolution_mm(), entry.bounds()},
                                       entry.values_xxh3, read_layers_sandboxed);
    if (digest(content) == entry.digest) return content;
  } catch (const Error&) {  // nothing to be had from it
  }
  return {};
}

struct MapRepair::State final : TileSink {
  State(const fs::path& map, const Manifest& from, const MapCheck& check)
      : folder(map),
        manifest(from),
        crs(crs_of(from)),
        lock(lock_folder(map)),
        has_view(check.has_view),
        missing(check.damaged) {
    if (read_manifest(folder).info.revision != from.info.revision)
      throw Error(ErrorCode::kFailed, "a build has replaced the map meanwhile; verify it again", folder.string());
    for (const std::size_t s : missing) shard_at.emplace(manifest.shards[s].id, s);
  }

  bool put_back(std::size_t shard, const TerrainTile& content) {
    ShardEntry entry = manifest.shards[shard];
    if (content.box != entry.bounds()) return false;
    const EncodedShard encoded = encode_shard(content, crs);
    if (encoded.values_xxh3 != entry.values_xxh3 || digest(content) != entry.digest) return false;
    const std::uint64_t hash = xxh3_64(encoded.file);
    const bool same_file = hash == entry.file_xxh3 && encoded.file.size() == entry.bytes;
    entry.bytes = encoded.file.size();
    entry.file_xxh3 = hash;
    if (!same_file) entry.file = shard_file_name(entry.id, manifest.info.revision + 1);
    AtomicFile file = AtomicFile::written(folder / kShardFolder / entry.file, encoded.file);
    const std::lock_guard guard(mutex);
    file.place();
    missing.erase(shard);
    if (!same_file) changed.insert_or_assign(shard, std::move(entry));
    return true;
  }

  // Of the tiles of a build only those of missing shards are kept, until their shard is complete.
  Digest put(TileId id, TerrainTile&& tile) override {
    const Digest kept = digest(tile);
    const auto at = shard_at.find(shard_of(manifest.info.layout, id));
    if (at == shard_at.end() || tile.box.empty()) return kept;
    std::vector<PlacedTile> complete;
    {
      const std::lock_guard guard(mutex);
      std::vector<PlacedTile>& tiles = waiting[at->second];
      tiles.emplace_back(id, std::move(tile));
      if (tiles.size() < manifest.shards[at->second].tiles.size()) return kept;
      complete = std::move(tiles);
    }
    put_back(at->second, assemble(std::move(complete)));
    return kept;
  }

  const fs::path folder;
  Manifest manifest;
  const std::optional<Crs> crs;
  const Descriptor lock;
  std::map<TileId, std::size_t> shard_at;  // that were missing at first
  bool has_view;
  std::mutex mutex;  // guards what follows
  std::set<std::size_t> missing;
  std::map<std::size_t, ShardEntry> changed;
  std::map<std::size_t, std::vector<PlacedTile>> waiting;
};

MapRepair::MapRepair(const fs::path& folder, const Manifest& manifest, const MapCheck& check)
    : state_(std::make_unique<State>(folder, manifest, check)) {}
MapRepair::~MapRepair() = default;

const std::set<std::size_t>& MapRepair::missing() const { return state_->missing; }

bool MapRepair::put_back(std::size_t shard, const TerrainTile& content) { return state_->put_back(shard, content); }

TileSink& MapRepair::sink(const MapLayout& layout) {
  if (layout != state_->manifest.info.layout)
    throw Error(ErrorCode::kBadInput, "these are not the points the map was made of: they make other tiles",
                state_->folder.string());
  return *state_;
}

void MapRepair::finish() {
  State& s = *state_;
  if (s.changed.empty()) {
    sync_folder(s.folder / kShardFolder);
    if (!s.has_view) publish_view(s.folder, s.manifest, s.crs);
    return;
  }
  ++s.manifest.info.revision;
  for (auto& [shard, entry] : s.changed) s.manifest.shards[shard] = std::move(entry);
  remove_journals(s.folder);  // of a build of this revision that was interrupted: its records are nothing to this map
  remove_round_files(s.folder, s.manifest.info.revision);
  publish_revision(s.folder, s.manifest, s.crs, [] {});
}

}  // namespace btms
