// The moment in which a folder becomes the next revision of a map.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include "io/crs/crs.h"
#include "io/store/manifest.h"

namespace btms {

// Writes manifest and map.nc and swaps both by rename, the manifest first: the commit point, of which `committed` is
// told. Then removes shards that neither it names nor the one before. Its shards must be in place, their folder need
// not be synced; the caller holds the folder's lock. Throws Error(kFailed); before the commit point the old revision is
// untouched then.
void publish_revision(const std::filesystem::path& folder, const Manifest& manifest, const std::optional<Crs>& crs,
                      const std::function<void()>& committed);

// map.nc alone: the view of the revision that is there.
void publish_view(const std::filesystem::path& folder, const Manifest& manifest, const std::optional<Crs>& crs);

}  // namespace btms
