// The map on disk: a folder NAME.btms of immutable HDF5 shards, a manifest, and map.nc, one virtual file over all
// shards. Format: docs/store_format.md. HDF5 stays inside io/store.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/model/tile_store.h"
#include "engine/terrain/parameters.h"

namespace btms {

struct Manifest;      // manifest.h
struct ShardEntry;    // manifest.h
class ShardOverview;  // shard_overview.h

struct InputRecord {
  std::string name;
  std::uint64_t points = 0;
  std::uint64_t bytes = 0;
  std::string path = {};        // from the map's folder, or absolute; empty in maps of older programs
  std::string content = {};     // what its bytes are: content_print()
  std::int64_t changed_ns = 0;  // when it was last written to, since 1970; not stored
};

struct TrajectoryRecord {
  std::string name;
  std::uint64_t poses = 0;
  std::uint64_t bytes = 0;
  std::string content = {};  // as of an input
};

// What a map says of itself.
struct MapInfo {
  MapLayout layout;
  Parameters parameters;
  std::string preset;      // name the parameters started from, or empty
  std::string crs_wkt;     // WKT2 with its EPSG id where there is one, or empty
  bool crs_given = false;  // the user said so, whatever the inputs say
  std::vector<InputRecord> inputs;
  std::optional<TrajectoryRecord> trajectory;  // of the sensor, where one was given
  Digest digest;                               // of the decoded content of all shards
  std::uint64_t revision = 1;
  std::uint64_t points = 0, dropped = 0;
  std::uint64_t updatable_since = 0;     // the revision from which on the records of the rounds hold; 0: none are kept
  std::vector<std::string> round_files;  // names of the files that hold them
  std::uint64_t follows = 0;             // of a build: the revision that it updates; not stored
};

// How a writer begins.
struct WriterOptions {
  int rank = 0;
  std::string crs = {};       // WKT or "EPSG:n", georeferences the shards; give the same to publish()
  std::string identity = {};  // build_identity() of what is built
  bool resume = false;        // keep what an interrupted build of the same has committed; else that is removed
  bool leave = false;         // when the writer is destroyed unpublished all stays: others may be at work, or come
};

// Writes one revision of a map. put() is thread-safe: tiles are encoded in the calling thread, only the HDF5 call is
// serialised. A shard is one tile, or a block of tiles when tiles are small; it is written under a temporary name,
// closed with every return code checked, fsynced and renamed; when its name is on disk too, the journal says that it is
// committed. Nothing of the map can be opened before publish(), and an older map in the same folder stays as it was.
// When a writer is destroyed before it, what has been committed stays for a build that takes it up; with nothing
// committed nothing stays. Shards that are as in the map before, or in the journal, are not written again.
// Rank 0's writer locks the folder against other builds, never against readers. Tiles with an empty box are not stored.
class MapWriter : public TileSink {
 public:
  // No rank may put() before rank 0's writer exists, which takes the lock. Throws Error(kFailed), also when another
  // build writes to `folder`, Error(kUsage) when it exists and is not a map, or holds an interrupted build of something
  // else that is to be taken up, or what describe_crs() throws.
  static std::unique_ptr<MapWriter> create(const std::filesystem::path& folder, const MapLayout& layout,
                                           const WriterOptions& options = {});
  // The revision that is being written.
  virtual std::uint64_t revision() const = 0;

  // Writes the shards that are still incomplete, and returns this rank's manifest entries as bytes. Call once, after
  // the last put(). With several ranks every tile of a shard must have been put on the same rank (see shard_of).
  // Afterwards the shards of ranks other than 0 are in rank 0's care. Throws Error(kFailed) when a put() has failed.
  virtual std::vector<std::uint8_t> finish() = 0;

  // Rank 0: writes manifest and map.nc from every rank's finish() bytes, and renames the manifest into place: the
  // commit point, then map.nc. Shards that neither this revision nor the one before it names are deleted after that.
  // Layout, revision and digest of `info` are filled in here, and its CRS is normalised. Every rank must have finished.
  virtual void publish(const MapInfo& info, const std::vector<std::vector<std::uint8_t>>& entries) = 0;
};

// Tiles of equal shard ids are stored in one file: blocks of k x k tiles with k = ceil(64 / edge), so that small tiles
// don't make small files.
TileId shard_of(const MapLayout& layout, TileId tile);

// Whether HDF5 may parse a shard in this process once its hash is right, or only in a sandboxed child: hashes keep out
// accidents, not authors.
enum class Trust : std::uint8_t { kTrusted, kUntrusted };

// A raster as it is stored: the bytes of one chunk of HDF5, deflated (zlib) of shuffled elements, then 4 bytes
// Fletcher-32. Rows from north to south.
struct StoredRaster {
  CellBox box;                      // that it covers
  std::size_t element_bytes = 0;    // 4: float32; 1: class, 255 where there is nothing
  std::vector<std::uint8_t> bytes;  // none: nothing anywhere
};

struct LayerValues {
  CellBox box;
  std::vector<float> values;  // from north to south
};

// An opened revision; immutable, thread-safe. load() reads, checks the hash and decodes; callers cache.
class MapReader : public TileSource {
 public:
  // Throws Error(kBadInput) when it is not a map, Error(kVerification) when the manifest's own hash is wrong.
  // With kUntrusted no other thread may write maps meanwhile (see read_layers_sandboxed).
  static std::unique_ptr<MapReader> open(const std::filesystem::path& folder, Trust trust = Trust::kTrusted);
  // Of a manifest that read_manifest() has read.
  static std::unique_ptr<MapReader> open(const std::filesystem::path& folder, Manifest manifest,
                                         Trust trust = Trust::kTrusted);
  virtual const MapInfo& info() const = 0;

  // What is stored, ascending.
  virtual std::span<const ShardEntry> shards() const = 0;
  // What one of them shows from afar; nothing of one that an older program wrote, or of an untrusted map: load() its
  // tiles. Throws Error(kVerification) when the file or its overview is damaged.
  virtual std::optional<ShardOverview> overview(const ShardEntry& shard) const = 0;
  // A layer of the root over a tile, without decoding it; nothing where the tile is not a shard of its own with one
  // chunk a layer (tiles of up to 128 squares are, from 64 on), or as of overview(). The same errors. Precondition: the
  // layer is one of raster_layers().
  virtual std::optional<StoredRaster> stored_raster(TileId id, std::string_view layer) const = 0;
  // The same, decoded into floats, NaN where there is nothing: a tenth of the work of load().
  virtual std::optional<LayerValues> layer_values(TileId id, std::string_view layer) const = 0;
};

}  // namespace btms
