// The chunks of a shard, whoever finds them: its own index (chunk_index.h), or HDF5 (hdf5_chunks.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "engine/error.h"
#include "io/store/upper_layers.h"

namespace btms {

class StoredChunks {
 public:
  virtual ~StoredChunks() = default;
  // Entries of the lists of further surfaces; 0 where the shard has none.
  virtual std::size_t upper() const = 0;
  // As stored, until the next call; empty where none was written. Throws Error(kVerification).
  virtual std::span<const std::uint8_t> chunk(const LayerInfo& layer, std::size_t row0, std::size_t col0) = 0;
};

// Of a shard's file: where a chunk's bytes are. No bytes: it was not written, all of it is the fill value.
struct ChunkPlace {
  std::uint64_t offset = 0, bytes = 0;
  friend bool operator==(const ChunkPlace&, const ChunkPlace&) = default;
};

[[noreturn]] inline void damaged_shard(const std::string& why) { throw Error(ErrorCode::kVerification, why); }
inline std::string dataset_name(const LayerInfo& layer) { return std::string(layer.in_tgf ? "tgf/" : "") + layer.name; }
// Most entries that the lists of a box can have.
inline std::size_t most_upper(const CellBox& box) {
  return static_cast<std::size_t>(box.cells()) * kTriangles * kMaxUpperPerNode;
}

}  // namespace btms
