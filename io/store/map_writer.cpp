#include <algorithm>
#include <mutex>
#include <set>

#include "engine/error.h"
#include "io/files/atomic_file.h"
#include "io/files/read_file.h"
#include "io/store/hash.h"
#include "io/store/journal.h"
#include "io/store/map_folder.h"
#include "io/store/publish.h"
#include "io/store/round_files.h"
#include "io/store/shard_assembly.h"
#include "io/store/shard_file.h"
#include "io/store/upper_layers.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

std::string tile_text(TileId id) { return std::to_string(id.tx).append(",").append(std::to_string(id.ty)); }

class FolderWriter final : public MapWriter {
 public:
  FolderWriter(const fs::path& folder, const MapLayout& layout, const WriterOptions& options, std::optional<Crs> crs)
      : folder_(folder),
        layout_(layout),
        rank_(options.rank),
        identity_(options.identity),
        leave_(options.leave),
        crs_(std::move(crs)),
        block_(shard_block(layout)),
        lock_(rank_ == 0 ? lock_folder(folder) : Descriptor()),
        revision_(start_revision(folder)) {
    if (rank_ != 0) return;
    const auto interrupted = read_journals(folder_);
    if (!options.resume || !interrupted || interrupted->revision != revision_)
      clear_revision();
    else
      refuse_another_build(*interrupted);
    journal_.emplace(folder_, rank_, revision_, identity_);
  }

  ~FolderWriter() override {
    staged_.clear();
    if (published_ || leave_) return;
    try {
      // As long as rank 0 lives, it has the lock and cares for what every rank has written.
      std::optional<Descriptor> lock;
      if (rank_ != 0) lock = share_unlocked_folder(folder_);
      if (rank_ == 0 || lock) give_up();
    } catch (const std::exception&) {  // the next build tidies up
    }
  }

  std::uint64_t revision() const override { return revision_; }

  Digest put(TileId id, TerrainTile&& tile) override {
    try {
      return accept(id, std::move(tile));
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failed_ = true;
      throw;
    }
  }

  std::vector<std::uint8_t> finish() override {
    for (auto& [id, waiting] : pending_) write_shard(id, std::move(waiting));
    pending_.clear();
    commit(std::move(staged_));
    staged_.clear();
    if (failed_) throw Error(ErrorCode::kFailed, "a tile could not be stored, the map is incomplete", folder_.string());
    std::sort(shards_.begin(), shards_.end(), [](const ShardEntry& a, const ShardEntry& b) { return a.id < b.id; });
    finished_ = true;
    return entries_bytes(shards_);
  }

  void publish(const MapInfo& info, const std::vector<std::vector<std::uint8_t>>& entries) override {
    Manifest m;
    m.info = info;
    m.info.layout = layout_;
    m.info.revision = revision_;
    m.info.digest = {};
    for (const auto& bytes : entries)
      for (ShardEntry& s : parse_entries(bytes, layout_)) m.shards.push_back(std::move(s));
    std::sort(m.shards.begin(), m.shards.end(), [](const ShardEntry& a, const ShardEntry& b) { return a.id < b.id; });
    for (std::size_t i = 0; i < m.shards.size(); ++i) {
      m.info.digest += m.shards[i].digest;
      if (i > 0 && m.shards[i].id == m.shards[i - 1].id)
        throw Error(ErrorCode::kFailed, "two ranks wrote the same shard",
                    (folder_ / kShardFolder / m.shards[i].file).string());
    }
    if (!m.info.crs_wkt.empty() && (!crs_ || crs_->wkt != m.info.crs_wkt)) crs_ = describe_crs(m.info.crs_wkt);
    m.info.crs_wkt = crs_ ? crs_->wkt : "";

    m.info.round_files = newest_round_files(folder_, revision_, m.info.updatable_since);
    publish_revision(folder_, m, crs_, [this] { published_ = true; });
  }

 private:
  static constexpr std::size_t kBatch = 16;  // files fsynced together

  struct Staged {
    AtomicFile file;
    ShardEntry entry;
  };
  // Tiles of one shard.
  struct Waiting {
    std::vector<PlacedTile> tiles;
    Digest digest;  // their sum
  };

  Digest accept(TileId id, TerrainTile&& tile) {
    if (tile.resolution_mm != layout_.lattice.resolution_mm() ||
        tile.box.intersect(layout_.grid.box_of(id)) != (tile.box.empty() ? CellBox{} : tile.box) ||
        tile.box.cells() > kMaxShardCells)
      throw Error(ErrorCode::kFailed, "tile " + tile_text(id) + " doesn't belong to this map's lattice");
    if (!is_sound_list(tile.upper, tile.box))
      throw Error(ErrorCode::kFailed,
                  "tile " + tile_text(id) + " lists its further surfaces out of order, or too many of them");
    const TileId shard = shard_of(layout_, id);
    const Digest kept = digest(tile);
    Waiting complete;
    {
      const std::lock_guard lock(mutex_);
      if (finished_) throw Error(ErrorCode::kFailed, "a tile came after the writer had finished");
      if (!seen_.insert(id).second) throw Error(ErrorCode::kFailed, "tile " + tile_text(id) + " came twice");
      if (tile.box.empty()) return kept;
      Waiting& waiting = pending_[shard];
      waiting.tiles.emplace_back(id, std::move(tile));
      waiting.digest += kept;
      if (waiting.tiles.size() < static_cast<std::size_t>(block_) * static_cast<std::size_t>(block_)) return kept;
      complete = std::move(waiting);
      pending_.erase(shard);
    }
    write_shard(shard, std::move(complete));
    return kept;
  }

  void write_shard(TileId id, Waiting&& shard) {
    ShardEntry entry;
    entry.id = id;
    entry.file = shard_file_name(id, revision_);
    entry.digest = shard.digest;
    for (const auto& [tile_id, tile] : shard.tiles) entry.tiles.push_back({tile_id, tile.box});
    std::sort(entry.tiles.begin(), entry.tiles.end(),
              [](const TileEntry& a, const TileEntry& b) { return a.id < b.id; });
    if (const ShardEntry* known = as_before(entry)) {
      const std::lock_guard lock(mutex_);
      shards_.push_back(*known);
      return;
    }
    const EncodedShard encoded = encode_shard(assemble(std::move(shard.tiles)), crs_);
    entry.bytes = encoded.file.size();
    entry.file_xxh3 = xxh3_64(encoded.file);
    entry.values_xxh3 = encoded.values_xxh3;
    Staged staged{AtomicFile::written(shard_path(entry.file), encoded.file), entry};
    std::vector<Staged> batch;
    {
      const std::lock_guard lock(mutex_);
      shards_.push_back(std::move(entry));
      staged_.push_back(std::move(staged));
      if (staged_.size() == kBatch) batch.swap(staged_);
    }
    commit(std::move(batch));
  }

  // On disk under their names, then in the journal.
  void commit(std::vector<Staged>&& batch) {
    if (batch.empty()) return;
    std::vector<ShardEntry> entries;
    for (Staged& staged : batch) {
      staged.file.place();
      entries.push_back(std::move(staged.entry));
    }
    sync_folder(folder_ / kShardFolder);
    const std::lock_guard lock(journal_mutex_);
    if (!journal_) journal_.emplace(folder_, rank_, revision_, identity_);
    journal_->add(entries);
  }

  // What a build that is taken up has committed, and what the map before has.
  void find_known() {
    if (const auto published = read_manifest_of(folder_);
        published && published->info.layout == layout_ && published->info.crs_wkt == (crs_ ? crs_->wkt : ""))
      for (const ShardEntry& s : published->shards) known_[s.id] = s;
    if (const auto interrupted = read_journals(folder_); interrupted && interrupted->revision == revision_)
      for (ShardEntry& s : journaled_shards(*interrupted, layout_)) known_[s.id] = std::move(s);
  }

  // The entry of a sound file with the same tiles, or nullptr.
  const ShardEntry* as_before(const ShardEntry& now) {
    std::call_once(known_once_, [&] { find_known(); });
    const auto it = known_.find(now.id);
    if (it == known_.end() || it->second.digest != now.digest || it->second.tiles.size() != now.tiles.size() ||
        !std::equal(now.tiles.begin(), now.tiles.end(), it->second.tiles.begin(),
                    [](const TileEntry& a, const TileEntry& b) { return a.id == b.id && a.box == b.box; }))
      return nullptr;
    try {
      const std::vector<std::uint8_t> bytes =
          read_file(shard_path(it->second.file), it->second.bytes, ErrorCode::kVerification);
      return bytes.size() == it->second.bytes && xxh3_64(bytes) == it->second.file_xxh3 ? &it->second : nullptr;
    } catch (const Error&) {
      return nullptr;  // written anew
    }
  }

  // Nothing that an interrupted build has left may come up under the journal of this one.
  void clear_revision() const {
    remove_revision(folder_, revision_);
    if (has_round_files(folder_, revision_))
      throw Error(ErrorCode::kFailed, "cannot remove what an interrupted build has left; remove it",
                  (folder_ / kRoundFolder).string());
    if (fs::exists(folder_ / kRoundFolder)) sync_folder(folder_ / kRoundFolder);
    sync_folder(folder_ / kShardFolder);
  }

  void refuse_another_build(const Interrupted& interrupted) const {
    if (const std::string what = identity_difference(interrupted.identity, identity_); !what.empty())
      throw Error(ErrorCode::kUsage,
                  "the interrupted build there was another one (" + what +
                      "); leave out --resume to begin afresh, or choose another name",
                  folder_.string());
  }

  // What is committed stays. What is published too: an error can follow the rename of the manifest.
  void give_up() const {
    const auto published = published_revision(folder_);
    if (!published || *published >= revision_) return;
    const auto interrupted = read_journals(folder_);
    if (interrupted && interrupted->revision == revision_ &&
        (!interrupted->entries.empty() || has_round_files(folder_, revision_))) {
      remove_stale_temporaries(folder_);
      remove_stale_temporaries(folder_ / kShardFolder);
      remove_stale_temporaries(folder_ / kRoundFolder);
      return;
    }
    remove_revision(folder_, revision_);
    std::error_code ignored;
    fs::remove(folder_ / journal_name(rank_), ignored);  // also when the folder can't be listed
    remove_if_empty(folder_);
  }

  fs::path shard_path(const std::string& file) const { return folder_ / kShardFolder / file; }

  const fs::path folder_;
  const MapLayout layout_;
  const int rank_;
  const std::string identity_;
  const bool leave_;
  std::optional<Crs> crs_;
  const int block_;        // a shard is block_ x block_ tiles
  const Descriptor lock_;  // rank 0: held until the end
  const std::uint64_t revision_;
  std::mutex mutex_;  // guards what follows
  std::set<TileId> seen_;
  std::map<TileId, Waiting> pending_;  // shards that wait for more tiles
  std::vector<ShardEntry> shards_;
  std::vector<Staged> staged_;  // written, not yet durable
  std::once_flag known_once_;
  std::map<TileId, ShardEntry> known_;  // shards that may be there already
  std::mutex journal_mutex_;
  std::optional<Journal> journal_;
  bool failed_ = false, finished_ = false, published_ = false;
};

}  // namespace

std::unique_ptr<MapWriter> MapWriter::create(const fs::path& folder, const MapLayout& layout,
                                             const WriterOptions& options) {
  std::optional<Crs> described;
  if (!options.crs.empty()) described = describe_crs(options.crs);
  return std::make_unique<FolderWriter>(folder, layout, options, std::move(described));
}

}  // namespace btms
