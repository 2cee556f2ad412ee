// Where the chunks of a shard are, and what it shows from afar, written behind what HDF5 knows of the file: so both are
// found without its library, and without its lock. docs/store_format.md has the bytes. Files of older programs have
// none.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "io/store/stored_chunks.h"

namespace btms {

// Appends the index: `places` of all chunks of all layers that a shard with `upper` further surfaces has, in the order
// of layer_table() and each_chunk(), and the shard's overview (shard_overview.h). `values_xxh3` is of EncodedShard.
void append_chunk_index(std::vector<std::uint8_t>& file, std::size_t upper, std::span<const ChunkPlace> places,
                        std::span<const std::uint8_t> overview, std::uint64_t values_xxh3);

// What a file of just these bytes and values has, read by itself; nothing when it has no index. Throw
// Error(kVerification) when it is another file, or what was read is damaged.
struct IndexedFile {
  std::filesystem::path path;
  std::uint64_t bytes = 0, values_xxh3 = 0;
};
std::optional<std::vector<std::uint8_t>> read_overview(const IndexedFile& file);
// A chunk as stored; empty where none was written. `box` is the shard's.
std::optional<std::vector<std::uint8_t>> read_chunk(const IndexedFile& file, const CellBox& box, const LayerInfo& layer,
                                                    std::size_t row0, std::size_t col0);
// The overview of a whole file; empty when it has no sound index.
std::span<const std::uint8_t> overview_in(std::span<const std::uint8_t> file);

// Looks into the bytes it was made of. Not for several threads at a time.
class IndexedChunks final : public StoredChunks {
 public:
  // Nothing when the file has no sound index of a shard over the box.
  static std::optional<IndexedChunks> of(std::span<const std::uint8_t> file, const CellBox& box);

  std::size_t upper() const override { return upper_; }
  std::span<const std::uint8_t> chunk(const LayerInfo& layer, std::size_t row0, std::size_t col0) override;
  ChunkPlace place(const LayerInfo& layer, std::size_t row0, std::size_t col0) const;

 private:
  friend std::optional<std::vector<std::uint8_t>> read_chunk(const IndexedFile&, const CellBox&, const LayerInfo&,
                                                             std::size_t, std::size_t);
  IndexedChunks(std::span<const std::uint8_t> file, const CellBox& box) : file_(file), box_(box) {}
  // Of the last bytes of a file alone: chunk() finds nothing then.
  static std::optional<IndexedChunks> of_tail(std::span<const std::uint8_t> tail, std::uint64_t file_bytes,
                                              const CellBox& box);
  std::span<const std::uint8_t> file_;
  CellBox box_;
  std::size_t upper_ = 0;
  std::vector<ChunkPlace> places_;
  std::vector<std::size_t> first_;  // of every layer in layer_table(): its place, where the shard has it
};

}  // namespace btms
