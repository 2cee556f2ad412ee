#include "io/store/map_folder.h"

#include "engine/error.h"
#include "io/store/commit.h"
#include "io/store/manifest.h"
#include "io/store/map_nc.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

// Names of the entries of a folder; nothing where it can't be read.
std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (fs::directory_iterator it(folder, ignored), end; !ignored && it != end; it.increment(ignored))
    names.push_back(it->path().filename().string());
  return names;
}

void remove_names(const fs::path& folder, const auto& unwanted) {
  std::error_code ignored;
  for (const std::string& name : names_in(folder))
    if (unwanted(name)) fs::remove(folder / name, ignored);
}

// Only ever delete what a MapWriter could have written.
bool is_shard_name(const std::string& name) { return name.starts_with("x") && name.ends_with(".nc"); }

// A folder without a manifest may be written to when it holds nothing but the rest of a killed or running first build.
bool holds_foreign_files(const fs::path& folder) {
  for (const std::string& name : names_in(folder))
    if (name != kShardFolder && name != kMapNc && !name.starts_with(kTemporaryPrefix)) return true;
  return false;
}

}  // namespace

int shard_block(const MapLayout& layout) { return block_edge_tiles(layout.grid); }

TileId shard_of(const MapLayout& layout, TileId tile) { return block_of(layout.grid, tile); }

std::uint64_t start_revision(const fs::path& folder, int rank) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder)) {
    if (fs::exists(folder)) throw Error(ErrorCode::kUsage, "exists and is not a map", folder.string());
    throw Error(ErrorCode::kFailed, "could not create the folder: " + error.message(), folder.string());
  }
  std::uint64_t revision = 1;
  if (fs::exists(folder / kManifest)) {
    try {
      const auto text = read_file(folder / kManifest, kMaxManifest_bytes, ErrorCode::kBadInput);
      revision = parse_manifest(text, (folder / kManifest).string()).info.revision + 1;
    } catch (const Error& e) {
      if (e.code() == ErrorCode::kFailed) throw;
      throw Error(
          ErrorCode::kUsage,
          std::string("will not replace what is not a sound map; remove it or choose another name (") + e.what() + ")",
          folder.string());
    }
  } else if (holds_foreign_files(folder)) {
    throw Error(ErrorCode::kUsage, "exists and is not a map", folder.string());
  }
  fs::create_directories(folder / kShardFolder, error);
  if (error)
    throw Error(ErrorCode::kFailed, "could not create the folder: " + error.message(),
                (folder / kShardFolder).string());
  const std::string own = kTemporaryPrefix + std::to_string(rank) + "-";
  for (const fs::path& place : {folder, folder / kShardFolder})
    remove_names(place, [&](const std::string& name) { return name.starts_with(own); });
  return revision;
}

void remove_unreferenced(const fs::path& folder, const std::set<std::string>& keep) {
  const auto temporary = [](const std::string& name) { return name.starts_with(kTemporaryPrefix); };
  remove_names(folder, temporary);
  remove_names(folder / kShardFolder, [&](const std::string& name) {
    return temporary(name) || (is_shard_name(name) && !keep.contains(name));
  });
}

void remove_if_empty(const fs::path& folder) {
  std::error_code ignored;
  if (fs::exists(folder / kManifest, ignored)) return;
  fs::remove(folder / kShardFolder, ignored);  // fails while anything is in it
  fs::remove(folder, ignored);
}

}  // namespace btms
