#include "io/store/map_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cerrno>
#include <charconv>
#include <string_view>

#include "engine/error.h"
#include "io/files/atomic_file.h"
#include "io/files/read_file.h"
#include "io/store/hash.h"
#include "io/store/journal.h"
#include "io/store/round_files.h"

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
    if (unwanted(name) && fs::is_regular_file(fs::symlink_status(folder / name, ignored)))
      fs::remove(folder / name, ignored);
}

// A folder without a manifest may be written to when it holds nothing but the rest of a killed or running first build.
bool holds_foreign_files(const fs::path& folder) {
  for (const std::string& name : names_in(folder))
    if (name != kShardFolder && name != kRoundFolder && !is_journal_name(name) && !is_temporary_name(name)) return true;
  for (const std::string& name : names_in(folder / kShardFolder))
    if (!shard_revision(name) && !is_temporary_name(name)) return true;
  return false;
}

Descriptor open_folder(const fs::path& folder) {
  return Descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
}

// Whether `folder` is still the name of what was opened.
bool is_same(const Descriptor& fd, const fs::path& folder) {
  struct stat opened {
  }, named{};
  return ::fstat(fd.get(), &opened) == 0 && ::stat(folder.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
         opened.st_ino == named.st_ino;
}

std::vector<std::uint8_t> manifest_bytes(const fs::path& folder) {
  return read_file(folder / kManifest, kMaxManifest_bytes, ErrorCode::kBadInput);
}

}  // namespace

int shard_block(const MapLayout& layout) { return block_edge_tiles(layout.grid); }

TileId shard_of(const MapLayout& layout, TileId tile) { return block_of(layout.grid, tile); }

std::string shard_file_name(TileId id, std::uint64_t revision) {
  std::string name = "x";
  name.append(std::to_string(id.tx)).append("_y").append(std::to_string(id.ty));
  return name.append(".r").append(std::to_string(revision)).append(".nc");
}

std::optional<std::uint64_t> shard_revision(const std::string& name) {
  TileId id;
  std::uint64_t revision = 0;
  std::string_view rest = name;
  const auto take = [&rest](std::string_view before, auto& number) {
    if (!rest.starts_with(before)) return false;
    rest.remove_prefix(before.size());
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    return error == std::errc();
  };
  if (!take("x", id.tx) || !take("_y", id.ty) || !take(".r", revision)) return {};
  if (name != shard_file_name(id, revision)) return {};  // the one way to write it
  return revision;
}

void make_folder(const fs::path& folder) {
  if (fs::exists(folder) && !fs::is_directory(folder))
    throw Error(ErrorCode::kUsage, "exists and is not a map", folder.string());
  make_folders(folder);
}

Descriptor lock_folder(const fs::path& folder) {
  // A build that is given up removes its folder, perhaps between our opening and locking it.
  for (int attempt = 0; attempt < 100; ++attempt) {
    make_folder(folder);
    Descriptor fd = open_folder(folder);
    if (fd.get() < 0) {
      if (errno == ENOENT) continue;
      throw Error(ErrorCode::kFailed, "could not open the folder: " + system_reason(errno), folder.string());
    }
    if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) break;
    if (is_same(fd, folder)) return fd;
  }
  throw Error(ErrorCode::kFailed, "another build is writing here; wait for it, or choose another name",
              folder.string());
}

std::optional<Descriptor> share_unlocked_folder(const fs::path& folder) {
  Descriptor fd = open_folder(folder);
  if (fd.get() < 0 || ::flock(fd.get(), LOCK_SH | LOCK_NB) != 0 || !is_same(fd, folder)) return {};
  return fd;
}

std::uint64_t start_revision(const fs::path& folder) {
  make_folder(folder);
  std::uint64_t revision = 1;
  if (fs::exists(folder / kManifest)) {
    try {
      revision = read_manifest(folder).info.revision + 1;
    } catch (const Error& e) {
      if (e.code() == ErrorCode::kFailed) throw;
      if (is_of_older_program(manifest_bytes(folder)))
        throw Error(ErrorCode::kUsage, "this map was made by an older program; remove it first, or choose another name",
                    folder.string());
      throw Error(
          ErrorCode::kUsage,
          std::string("will not replace what is not a sound map; remove it or choose another name (") + e.what() + ")",
          folder.string());
    }
  } else if (holds_foreign_files(folder)) {
    throw Error(ErrorCode::kUsage, "exists and is not a map", folder.string());
  }
  make_folders(folder / kShardFolder);
  return revision;
}

Manifest read_manifest(const fs::path& folder) {
  return parse_manifest(manifest_bytes(folder), (folder / kManifest).string());
}

std::vector<std::uint8_t> read_shard(const fs::path& folder, const ShardEntry& entry) {
  const fs::path file = folder / kShardFolder / entry.file;
  const auto damaged = [](const std::string& why) { throw Error(ErrorCode::kVerification, why); };
  std::vector<std::uint8_t> bytes;
  try {
    bytes = read_file(file, entry.bytes, ErrorCode::kVerification);
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kVerification) throw;
    damaged(fs::is_regular_file(file)
                ? "the file has grown"
                : "the file is missing (newer revisions may have replaced it: open the map again)");
  }
  if (bytes.size() != entry.bytes)
    damaged("file has " + std::to_string(bytes.size()) + " bytes, the manifest says " + std::to_string(entry.bytes));
  // Before HDF5 sees the file: its parser is not safe against damaged input.
  if (const std::uint64_t found = xxh3_64(bytes); found != entry.file_xxh3)
    damaged("file hashes to " + hex64(found) + ", the manifest says " + hex64(entry.file_xxh3));
  return bytes;
}

std::optional<Manifest> read_manifest_of(const fs::path& folder) {
  try {
    return read_manifest(folder);
  } catch (const Error&) {
    return {};
  }
}

std::optional<std::uint64_t> published_revision(const fs::path& folder) {
  if (!fs::exists(folder / kManifest)) return 0;
  const auto manifest = read_manifest_of(folder);
  if (!manifest) return {};
  return manifest->info.revision;
}

void remove_unreferenced(const fs::path& folder, const std::set<std::string>& keep) {
  remove_stale_temporaries(folder);
  remove_stale_temporaries(folder / kShardFolder);
  remove_names(folder / kShardFolder,
               [&](const std::string& name) { return shard_revision(name) && !keep.contains(name); });
}

void remove_revision(const fs::path& folder, std::uint64_t revision) {
  remove_stale_temporaries(folder);
  remove_stale_temporaries(folder / kShardFolder);
  remove_names(folder / kShardFolder, [&](const std::string& name) { return shard_revision(name) == revision; });
  remove_journals(folder);
  remove_round_files(folder, revision);
}

void remove_if_empty(const fs::path& folder) {
  std::error_code ignored;
  if (fs::exists(folder / kManifest, ignored)) return;
  fs::remove(folder / kShardFolder, ignored);  // fails while anything is in it
  fs::remove(folder, ignored);
}

}  // namespace btms
