// A map that is served: the revision that is published now, replaced as a whole when the next one is.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "apps/server/events.h"
#include "engine/routing/graph.h"
#include "io/store/map_store.h"
#include "io/store/projection.h"
#include "io/store/served_tiles.h"

namespace btms {

// One revision, immutable. A request holds one from beginning to end.
struct MapRevision {
  std::shared_ptr<const MapReader> reader;
  Terrain terrain;
  TraversalGraph graph;
  ServedTiles tiles;
  std::shared_ptr<const Projection> projection;  // nullptr where the map names no system PROJ can use
  std::string facts;                             // the answer to GET /v1/maps/{m}

  std::uint64_t number() const { return reader->info().revision; }
};

// Thread-safe.
class ServedMap {
 public:
  // Throws what opening throws.
  ServedMap(std::string id, std::filesystem::path folder, std::size_t cache_bytes);

  const std::string& id() const { return id_; }
  std::shared_ptr<const MapRevision> current() const { return current_.load(); }
  EventLog& events() const { return events_; }

  // Looks whether another revision has been published, opens it and tells the listeners. One thread at a time. A
  // revision that can't be opened is left out, and tried again when the manifest changes; returns what was wrong, or
  // nothing.
  std::string refresh();

 private:
  // Of the manifest's file: changes with every rename.
  struct Stamp {
    std::uint64_t inode = 0;
    std::int64_t changed_ns = 0, bytes = 0;
    friend bool operator==(const Stamp&, const Stamp&) = default;
  };
  Stamp stamp() const;
  std::shared_ptr<const MapRevision> open() const;

  const std::string id_;
  const std::filesystem::path folder_;
  const std::size_t cache_bytes_;
  Stamp seen_;
  std::atomic<std::shared_ptr<const MapRevision>> current_;
  mutable EventLog events_;
};

// The folder's name without .btms, letters, digits, - and _ kept, others replaced by -.
std::string map_id(const std::filesystem::path& folder);

// layers and format as they go into a tile's validator.
std::string tile_form(const std::string& layers, const std::string& format);

}  // namespace btms
