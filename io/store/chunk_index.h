// Where the chunks of a shard are, written behind what HDF5 knows of the file: so they are found without its library,
// and without its lock. docs/store_format.md has the bytes. Files of older programs have none.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "io/store/stored_chunks.h"

namespace btms {

// Appends the index: `places` of all chunks of all layers that a shard with `upper` further surfaces has, in the order
// of layer_table() and each_chunk().
void append_chunk_index(std::vector<std::uint8_t>& file, std::size_t upper, std::span<const ChunkPlace> places);

// Looks into the bytes it was made of. Not for several threads at a time.
class IndexedChunks final : public StoredChunks {
 public:
  // Nothing when the file has no sound index of a shard over the box.
  static std::optional<IndexedChunks> of(std::span<const std::uint8_t> file, const CellBox& box);

  std::size_t upper() const override { return upper_; }
  std::span<const std::uint8_t> chunk(const LayerInfo& layer, std::size_t row0, std::size_t col0) override;
  ChunkPlace place(const LayerInfo& layer, std::size_t row0, std::size_t col0) const;

 private:
  IndexedChunks(std::span<const std::uint8_t> file, const CellBox& box) : file_(file), box_(box) {}
  std::span<const std::uint8_t> file_;
  CellBox box_;
  std::size_t upper_ = 0;
  std::vector<ChunkPlace> places_;
  std::vector<std::size_t> first_;  // of every layer in layer_table(): its place, where the shard has it
};

}  // namespace btms
