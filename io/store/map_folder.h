// The folder of a map: names in it, which revision comes next, and cleaning up.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>

#include "io/store/map_store.h"

namespace btms {

inline constexpr char kManifest[] = "manifest.json";
inline constexpr char kMapNc[] = "map.nc";

// k of shard_of().
int shard_block(const MapLayout& layout);

// Makes the folder where it doesn't exist, removes what a killed writer of this rank has left, and returns the number
// of the revision to write. Throws Error(kUsage) when `folder` exists and is not a map.
std::uint64_t start_revision(const std::filesystem::path& folder, int rank);

// Deletes the shards not in `keep`, and temporary files. Failures are ignored: the next publish tries again.
void remove_unreferenced(const std::filesystem::path& folder, const std::set<std::string>& keep);

// Removes the folders of a map that never came to be.
void remove_if_empty(const std::filesystem::path& folder);

}  // namespace btms
