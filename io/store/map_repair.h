// Puts back what a map has lost, and nothing else: a shard is only ever replaced by one with the values its manifest
// states.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "engine/model/tile_store.h"
#include "io/store/map_check.h"

namespace btms {

// Content of a damaged shard that can still be read from its file: where the damage is in what is derived from the
// model, or in nothing that matters. HDF5 parses it in a sandbox. Nothing when the values are not the manifest's.
std::optional<TerrainTile> salvage_shard(const std::filesystem::path& folder, const Manifest& manifest,
                                         std::size_t shard);

// Not thread-safe, but for the sink's put(). Locks the folder against builds; readers go on.
class MapRepair {
 public:
  // Throws Error(kFailed) when a build is writing there, or when the map is no longer the one `manifest` was read from.
  MapRepair(const std::filesystem::path& folder, const Manifest& manifest, const MapCheck& check);
  ~MapRepair();

  // Shards that are still to be put back, as counted in the manifest.
  const std::set<std::size_t>& missing() const;

  // Puts `content` back as that shard, if it is what the manifest says; else nothing happens. Thread-safe.
  bool put_back(std::size_t shard, const TerrainTile& content);

  // Receives the tiles of a build from the map's inputs, and puts the missing shards back that come out as they were.
  // Throws Error(kBadInput) when `layout` is not the map's.
  TileSink& sink(const MapLayout& layout);

  // Makes what was put back part of the map, and map.nc its view. Shards whose files come out with other bytes (another
  // version of a library) make a new revision with the same values.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace btms
