// The folder of a map: names in it, the lock, which revision comes next, and cleaning up.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "io/files/descriptor.h"
#include "io/store/manifest.h"
#include "io/store/map_store.h"

namespace btms {

inline constexpr char kManifest[] = "manifest.json";
inline constexpr char kMapNc[] = "map.nc";
inline constexpr char kShardFolder[] = "shards";

// k of shard_of().
int shard_block(const MapLayout& layout);

// Unlike any name of another revision, so that both can lie in one folder: x3_y-1.r2.nc
std::string shard_file_name(TileId id, std::uint64_t revision);
// The revision of a name that shard_file_name() makes; nothing for any other name.
std::optional<std::uint64_t> shard_revision(const std::string& name);

// Makes the folder where it doesn't exist. Throws Error(kFailed), or Error(kUsage) when something else has the name.
void make_folder(const std::filesystem::path& folder);

// Makes the folder and locks it for the one build that may write there, for as long as the descriptor is open. Readers
// need no lock. Throws Error(kFailed) when another build has it. A file system without locks gives none, silently.
Descriptor lock_folder(const std::filesystem::path& folder);
// Whether no build holds the lock; what is done under the descriptor keeps builds from starting.
std::optional<Descriptor> share_unlocked_folder(const std::filesystem::path& folder);

// Makes the folder and returns the number of the revision to write. Throws Error(kUsage) when `folder` exists and is
// not a map.
std::uint64_t start_revision(const std::filesystem::path& folder);

// Throws Error(kBadInput) when there is none, or it is not whole; Error(kVerification) when its own hash is wrong.
Manifest read_manifest(const std::filesystem::path& folder);

// The file of a shard; not a byte of it parsed. Throws Error(kVerification) unless size and hash are the entry's.
std::vector<std::uint8_t> read_shard(const std::filesystem::path& folder, const ShardEntry& entry);

// The manifest, where there is a sound one.
std::optional<Manifest> read_manifest_of(const std::filesystem::path& folder);
// Revision of the manifest: 0 when there is none, nothing when it can't be read.
std::optional<std::uint64_t> published_revision(const std::filesystem::path& folder);

// These delete only what a MapWriter has written and ignore failures: the next publish tries again.
// The shards not in `keep`, and what killed writers have left.
void remove_unreferenced(const std::filesystem::path& folder, const std::set<std::string>& keep);
// The shards of a revision that was not published.
void remove_revision(const std::filesystem::path& folder, std::uint64_t revision);
// The folders of a map that never came to be.
void remove_if_empty(const std::filesystem::path& folder);

}  // namespace btms
