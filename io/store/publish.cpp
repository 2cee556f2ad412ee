#include "io/store/publish.h"

#include <set>
#include <string>

#include "io/files/atomic_file.h"
#include "io/store/journal.h"
#include "io/store/map_folder.h"
#include "io/store/map_nc.h"
#include "io/store/round_files.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

std::optional<AtomicFile> staged_view(const fs::path& folder, const Manifest& manifest, const std::optional<Crs>& crs) {
  const auto bytes = encode_map_nc(manifest.info.layout.lattice.resolution_mm(), manifest.shards, crs);
  std::optional<AtomicFile> view;
  if (!bytes.empty()) view.emplace(AtomicFile::written(folder / kMapNc, bytes));
  return view;
}

void place_view(const fs::path& folder, std::optional<AtomicFile>&& view) {
  std::error_code ignored;
  if (view)
    view->place();
  else
    fs::remove(folder / kMapNc, ignored);
  sync_folder(folder);
}

}  // namespace

void publish_revision(const fs::path& folder, const Manifest& manifest, const std::optional<Crs>& crs,
                      const std::function<void()>& committed) {
  // Readers that have just opened the old revision can finish: its shards stay until the next publish.
  std::set<std::string> keep;
  if (const auto old = read_manifest_of(folder))
    for (const ShardEntry& s : old->shards) keep.insert(s.file);
  for (const ShardEntry& s : manifest.shards) keep.insert(s.file);

  sync_folder(folder / kShardFolder);  // the names of every rank's shards
  if (manifest.info.updatable_since > 0) sync_folder(folder / kRoundFolder);
  std::optional<AtomicFile> view = staged_view(folder, manifest, crs);
  const std::string text = manifest_text(manifest);
  AtomicFile file =
      AtomicFile::written(folder / kManifest, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  if (view) view->sync();  // nothing is left that a full disk could stop
  // The manifest first: it decides what the map is, map.nc is a view.
  file.place();
  committed();
  sync_folder(folder);
  place_view(folder, std::move(view));

  remove_unreferenced(folder, keep);
  remove_journals(folder);
  prune_round_files(folder, manifest.info.revision, manifest.info.updatable_since);
}

void publish_view(const fs::path& folder, const Manifest& manifest, const std::optional<Crs>& crs) {
  place_view(folder, staged_view(folder, manifest, crs));
}

}  // namespace btms
