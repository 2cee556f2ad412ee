// manifest.json: what a map revision is made of. Text in, text out; no file access. docs/store_format.md has an
// example.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/store/map_store.h"

namespace btms {

inline constexpr std::uint64_t kMaxManifest_bytes = std::uint64_t{1} << 28;
inline constexpr std::int64_t kMaxShardCells = std::int64_t{1} << 28;

struct TileEntry {
  TileId id;
  CellBox box;  // never empty
};

struct ShardEntry {
  TileId id;                      // shard_of its tiles
  std::string file;               // plain name inside shards/
  std::uint64_t bytes = 0;        // of the file
  std::uint64_t file_xxh3 = 0;    // of the file's bytes
  std::uint64_t values_xxh3 = 0;  // of its decoded values, see EncodedShard
  Digest digest;                  // sum over its tiles
  std::vector<TileEntry> tiles;   // ascending

  CellBox bounds() const;  // hull of the tiles: what the file covers
};

struct Manifest {
  MapInfo info;
  std::vector<ShardEntry> shards;  // ascending
};

std::string manifest_text(const Manifest& manifest);
// Throws Error(kBadInput) for anything that is not a whole, consistent manifest; Error(kVerification) for one that is
// but has the wrong hash. `file` is the name for messages.
Manifest parse_manifest(std::span<const std::uint8_t> text, const std::string& file);

// Whether it is the sound manifest of a map of an earlier schema, which nothing but its removal is left for.
bool is_of_older_program(std::span<const std::uint8_t> text);

// One shard's entry. Throws Error(kBadInput).
std::string entry_text(const ShardEntry& entry);
ShardEntry parse_entry_text(std::string_view text, const MapLayout& layout);

// Shard entries alone, for finish().
std::vector<std::uint8_t> entries_bytes(const std::vector<ShardEntry>& shards);
std::vector<ShardEntry> parse_entries(std::span<const std::uint8_t> bytes, const MapLayout& layout);

}  // namespace btms
