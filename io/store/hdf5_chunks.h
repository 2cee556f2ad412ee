// The chunks of a shard as the HDF5 library finds them: of files without an index, and to check those that have one.
#pragma once

#include <optional>
#include <vector>

#include "io/crs/crs.h"
#include "io/store/hdf5.h"
#include "io/store/shard_layers.h"
#include "io/store/stored_chunks.h"

namespace btms {

class Hdf5Chunks final : public StoredChunks {
 public:
  // Compares the shapes of the wanted layers with what a writer writes over the shard's bounds; of Wanted::kAll axes
  // and reference system, too. Throws Error(kVerification) when they differ, Error(kFailed) when HDF5 does.
  Hdf5Chunks(const StoredShard& shard, Wanted wanted, const std::optional<Crs>& crs);

  std::size_t upper() const override { return upper_; }
  std::span<const std::uint8_t> chunk(const LayerInfo& layer, std::size_t row0, std::size_t col0) override;
  ChunkPlace place(const LayerInfo& layer, std::size_t row0, std::size_t col0);
  void close();

 private:
  Hdf5Dataset open_layer(const LayerInfo& layer) const;
  const Hdf5Dataset& opened(const LayerInfo& layer);

  const QuietHdf5 quiet_;
  CellBox box_;
  Hdf5File file_;
  std::size_t upper_ = 0;
  const LayerInfo* layer_ = nullptr;  // whose dataset is open
  Hdf5Dataset dataset_;
  std::vector<std::uint8_t> stored_;
};

// Where a chunk of an open dataset is. Takes longer the more chunks the dataset has.
ChunkPlace hdf5_place(hid_t dataset, const LayerInfo& layer, std::size_t row0, std::size_t col0);

}  // namespace btms
