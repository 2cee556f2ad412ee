#include "io/store/map_check.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>

#include "engine/error.h"
#include "io/files/atomic_file.h"
#include "io/files/read_file.h"
#include "io/store/journal.h"
#include "io/store/map_folder.h"
#include "io/store/map_nc.h"
#include "io/store/round_files.h"
#include "io/store/sandboxed_layers.h"
#include "io/store/seams.h"
#include "io/store/shard_file.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostMapNc_bytes = std::uint64_t{1} << 33;

std::string shard_name(const ShardEntry& shard) { return std::string(kShardFolder) + "/" + shard.file; }

std::vector<TileId> tiles_of(const ShardEntry& shard) {
  std::vector<TileId> tiles;
  for (const TileEntry& tile : shard.tiles) tiles.push_back(tile.id);
  return tiles;
}

// The shard's content; throws when anything about it is not as the manifest says.
TerrainTile checked_shard(const fs::path& folder, const Manifest& manifest, const ShardEntry& entry,
                          const std::optional<Crs>& crs, const LayerReading& reading) {
  std::vector<std::uint8_t> bytes;
  try {
    bytes = read_shard(folder, entry);
  } catch (const Error& e) {
    throw Error(ErrorCode::kVerification, e.what());  // a sector that can't be read is damage, too
  }
  TerrainTile content = check_shard({bytes, manifest.info.layout.lattice.resolution_mm(), entry.bounds()},
                                    entry.values_xxh3, crs, reading);
  if (const Digest found = digest(content); found != entry.digest)
    throw Error(ErrorCode::kVerification, "its digest is " + found.hex() + ", the manifest says " + entry.digest.hex());
  return content;
}

MapProblem seam_problem(const SeamProblem& p, const Manifest& manifest) {
  const auto& shards = manifest.shards;
  std::vector<TileId> tiles = tiles_of(shards[p.first]);
  for (const TileId id : tiles_of(shards[p.second])) tiles.push_back(id);
  const std::int64_t r_mm = manifest.info.layout.lattice.resolution_mm();
  const auto metres = [](std::int64_t mm) {
    const std::string text = std::to_string(static_cast<double>(mm) / 1000);
    return text.substr(0, text.size() - 3);
  };
  return {shard_name(shards[p.first]), std::move(tiles),
          "disagrees with " + shard_name(shards[p.second]) + " about " + std::to_string(p.corners) +
              " corner heights on their border, first at " + metres(p.where.col * r_mm) + "," +
              metres(p.where.row * r_mm) + " m: " + metres(p.first_mm) + " and " + metres(p.second_mm) + " m"};
}

// Why map.nc is not the view of these shards; nothing when it is.
std::optional<std::string> view_problem(const fs::path& folder, const Manifest& manifest,
                                        const std::optional<Crs>& crs) {
  const std::vector<std::uint8_t> expected =
      encode_map_nc(manifest.info.layout.lattice.resolution_mm(), manifest.shards, crs);
  std::vector<std::uint8_t> found;
  try {
    found = read_file(folder / kMapNc, kMostMapNc_bytes, ErrorCode::kVerification);
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kVerification) throw;
    if (fs::exists(fs::symlink_status(folder / kMapNc))) return e.what();
    if (expected.empty()) return {};
    return "is missing";
  }
  if (found == expected) return {};
  return "is not the view of this revision's shards: damaged, of another revision, or written by another version of "
         "HDF5";
}

// What every rank has found wrong.
std::map<std::size_t, std::string> joined(const std::map<std::size_t, std::string>& mine, Ranks& ranks) {
  if (ranks.size() == 1) return mine;
  const std::vector<std::uint8_t> text = nlohmann::json::to_cbor(nlohmann::json(mine));
  std::map<std::size_t, std::string> all;
  for (const Bytes& bytes : ranks.share(text))
    all.merge(nlohmann::json::from_cbor(bytes).get<std::map<std::size_t, std::string>>());
  return all;
}

// Of the revision before, or of a build at work or interrupted.
bool is_of_a_build(const std::string& name) {
  return name == kRoundFolder || is_journal_name(name) || is_temporary_name(name) || shard_revision(name);
}

std::vector<std::string> stray_files(const fs::path& folder, const Manifest& manifest) {
  std::set<std::string> own = {kManifest, kMapNc, kShardFolder};
  for (const ShardEntry& shard : manifest.shards) own.insert(shard_name(shard));
  std::vector<std::string> strays;
  std::error_code ignored;
  for (const char* part : {"", kShardFolder})
    for (fs::directory_iterator it(folder / part, ignored), end; !ignored && it != end; it.increment(ignored))
      if (const std::string name = (fs::path(part) / it->path().filename()).string();
          !own.contains(name) && !is_of_a_build(it->path().filename().string()))
        strays.push_back(name);
  std::sort(strays.begin(), strays.end());
  return strays;
}

}  // namespace

std::string tiles_text(const std::vector<TileId>& tiles) {
  constexpr std::size_t kShown = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(tiles.size(), kShown); ++i)
    text.append(i == 0 ? "" : " ").append(std::to_string(tiles[i].tx)).append(",").append(std::to_string(tiles[i].ty));
  if (tiles.size() > kShown) text.append(" and ").append(std::to_string(tiles.size() - kShown)).append(" more");
  return text;
}

MapCheck check_map(const fs::path& folder, const Manifest& manifest, Trust trust, const Threads& threads, Ranks& ranks,
                   Progress& progress) {
  MapCheck check;
  std::optional<Crs> crs;
  if (!manifest.info.crs_wkt.empty()) crs = describe_crs(manifest.info.crs_wkt);
  const LayerReading reading = trust == Trust::kTrusted ? read_layers : read_layers_sandboxed;
  Seams seams(manifest.shards);
  std::mutex mutex;
  std::map<std::size_t, std::string> wrong;  // by shard
  // Shards follow each other row by row: a rank's have few neighbours elsewhere.
  const auto part = [&](int rank) {
    return manifest.shards.size() * static_cast<std::size_t>(rank) / static_cast<std::size_t>(ranks.size());
  };
  const std::size_t begin = part(ranks.rank()), own = part(ranks.rank() + 1) - begin;
  progress.begin("verify", own, "shards");
  threads.for_each(own, [&](std::size_t i, int) {
    const std::size_t s = begin + i;
    if (progress.stop_requested()) throw Error(ErrorCode::kCancelled, "stopped");
    try {
      seams.add(s, checked_shard(folder, manifest, manifest.shards[s], crs, reading));
    } catch (const Error& e) {
      if (e.code() != ErrorCode::kVerification) throw;
      seams.skip(s);
      const std::lock_guard lock(mutex);
      wrong.emplace(s, e.what());
    }
    progress.advance(1);
  });
  seams.join(ranks);
  for (const auto& [s, what] : joined(wrong, ranks)) {
    check.problems.push_back({shard_name(manifest.shards[s]), tiles_of(manifest.shards[s]), what});
    check.damaged.insert(s);
  }
  for (const ShardEntry& shard : manifest.shards) check.bytes += shard.bytes;
  std::vector<SeamProblem> borders = seams.problems();
  std::sort(borders.begin(), borders.end(), [](const SeamProblem& a, const SeamProblem& b) {
    return std::pair(a.first, a.second) < std::pair(b.first, b.second);
  });
  for (const SeamProblem& p : borders) check.problems.push_back(seam_problem(p, manifest));
  if (auto problem = view_problem(folder, manifest, crs)) {
    check.has_view = false;
    check.problems.push_back({kMapNc, {}, std::move(*problem)});
  }
  if (manifest.info.updatable_since > 0)
    for (const std::string& name : damaged_round_files(folder, manifest.info.revision, manifest.info.updatable_since))
      check.problems.push_back({std::string(kRoundFolder) + "/" + name,
                                {},
                                "is damaged: an update can't follow it; build the map once more with --updatable"});
  check.strays = stray_files(folder, manifest);
  return check;
}

}  // namespace btms
