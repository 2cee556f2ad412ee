// Shards are read by their own index as HDF5 reads them, and without it where they have none.
#include "io/store/chunk_index.h"

#include <gtest/gtest.h>

#include <ostream>
#include <random>

#include "io/store/chunk_grid.h"
#include "io/store/hdf5_chunks.h"
#include "io/store/shard_file.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Named = std::vector<std::pair<std::string, Bytes>>;

struct Case {
  CellBox box;
  TerrainTile (*make)(const MapLayout&, const CellBox&);
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.box.cols() << " x " << c.box.rows(); }

// What the file was before the index was appended: one of an older program.
Bytes without_index(const Bytes& file) {
  std::uint64_t hdf5_bytes = 0;
  std::memcpy(&hdf5_bytes, file.data() + 28, sizeof hdf5_bytes);  // "end of file" of an HDF5 superblock
  return {file.begin(), file.begin() + static_cast<std::ptrdiff_t>(hdf5_bytes)};
}

Named layers_of(const StoredShard& shard, Wanted wanted) {
  Named layers;
  read_layers(shard, wanted, {}, [&](const LayerInfo& layer, std::size_t, Bytes&& raster) {
    layers.emplace_back(dataset_name(layer), std::move(raster));
  });
  return layers;
}

class ChunkIndexOf : public testing::TestWithParam<Case> {
 protected:
  const MapLayout layout_ = layout_of(2000, 512);
  const CellBox box_ = GetParam().box;
  const TerrainTile tile_ = GetParam().make(layout_, box_);
  const EncodedShard encoded_ = encode_shard(tile_, {});
  const Bytes& file_ = encoded_.file;
  StoredShard shard(const Bytes& file) const { return {file, 2000, box_}; }
};

TEST_P(ChunkIndexOf, EveryChunkIsWhereHdf5HasIt) {
  const auto index = IndexedChunks::of(file_, box_);
  ASSERT_TRUE(index);
  Hdf5Chunks hdf5(shard(file_), Wanted::kAll, {});
  ASSERT_EQ(index->upper(), hdf5.upper());
  IndexedChunks indexed = *index;
  std::size_t chunks = 0, unwritten = 0;
  for (const LayerInfo& layer : layer_table()) {
    if (!is_read(layer, Wanted::kAll, hdf5.upper())) continue;
    each_chunk(layer_shape(layer, box_, hdf5.upper()), chunk_shape(layer, box_, hdf5.upper()),
               [&](std::size_t row0, std::size_t col0) {
                 EXPECT_EQ(indexed.place(layer, row0, col0), hdf5.place(layer, row0, col0)) << layer.name;
                 const std::span a = indexed.chunk(layer, row0, col0), b = hdf5.chunk(layer, row0, col0);
                 EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end())) << layer.name;
                 ++chunks;
                 unwritten += a.empty();
               });
  }
  EXPECT_GT(chunks, unwritten);
  hdf5.close();
}

TEST_P(ChunkIndexOf, LayersAreTheSameWithAndWithout) {
  const Bytes old = without_index(file_);
  ASSERT_FALSE(IndexedChunks::of(old, box_));
  for (const Wanted wanted : {Wanted::kModel, Wanted::kLabels, Wanted::kAll})
    EXPECT_EQ(layers_of(shard(file_), wanted), layers_of(shard(old), wanted));
  for (const Bytes& file : {file_, old})
    EXPECT_EQ(digest(decode_shard(shard(file), encoded_.values_xxh3)), digest(tile_));
}

// A file whose author changed the index, and its hashes with it, is read as one that has none, or not at all.
TEST_P(ChunkIndexOf, DamagedAndForgedIndicesShowNothingElse) {
  constexpr std::size_t kEnd_bytes = 64;
  const std::size_t overview_bytes = overview_in(file_).size();
  const std::size_t index_bytes = file_.size() - without_index(file_).size();
  std::mt19937_64 random(5);
  for (int i = 0; i < 300; ++i) {
    Bytes bad = file_;
    bad[bad.size() - 1 - random() % index_bytes] ^= static_cast<std::uint8_t>(1 + random() % 255);
    EXPECT_TRUE(!IndexedChunks::of(bad, box_) || overview_in(bad).size() < overview_bytes);
    if (i < 3) {
      EXPECT_EQ(layers_of(shard(bad), Wanted::kModel), layers_of(shard(file_), Wanted::kModel));
    }
  }
  // Places anywhere, with a hash that is right.
  std::vector<ChunkPlace> places((index_bytes - overview_bytes - kEnd_bytes) / sizeof(ChunkPlace));
  const std::size_t upper = IndexedChunks::of(file_, box_)->upper(), plain = file_.size() - index_bytes;
  for (int i = 0; i < 30; ++i) {
    for (ChunkPlace& p : places) p = {random() % (plain + 8), random() % 3 == 0 ? random() : random() % plain};
    Bytes forged(file_.begin(), file_.end() - static_cast<std::ptrdiff_t>(index_bytes));
    append_chunk_index(forged, upper, places, overview_in(file_), encoded_.values_xxh3);
    try {
      if (decode_shard(shard(forged), encoded_.values_xxh3).nodes != tile_.nodes) ADD_FAILURE() << "another tile";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kVerification);
    }
    if (IndexedChunks::of(forged, box_)) {
      EXPECT_EQ(thrown_code([&] { layers_of(shard(forged), Wanted::kAll); }), ErrorCode::kVerification);
    }
  }
  // Swapped, so that every chunk is sound and in the wrong place.
  const auto index = IndexedChunks::of(file_, box_);
  std::memcpy(places.data(), file_.data() + plain, places.size() * sizeof places[0]);
  for (std::size_t i = 0; i + 1 < places.size(); i += 1 + places.size() / 25) {
    if (places[i] == places[i + 1]) continue;
    std::vector<ChunkPlace> swapped = places;
    std::swap(swapped[i], swapped[i + 1]);
    Bytes forged(file_.begin(), file_.end() - static_cast<std::ptrdiff_t>(index_bytes));
    append_chunk_index(forged, upper, swapped, overview_in(file_), encoded_.values_xxh3);
    EXPECT_EQ(thrown_code([&] { layers_of(shard(forged), Wanted::kAll); }), ErrorCode::kVerification) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, ChunkIndexOf,
                         testing::Values(Case{{0, 0, 128, 128}, hilly_tile}, Case{{-3, 5, 37, 18}, noisy_tile},
                                         Case{{7, 7, 8, 8}, noisy_tile}, Case{{0, 0, 300, 131}, noisy_tile},
                                         Case{{-200, -20, 60, 240}, hilly_tile}));

// All layers of nothing: no chunk is written at all.
TEST(ChunkIndex, AShardWithoutAnythingHasOneToo) {
  const CellBox box{0, 0, 130, 4};
  const EncodedShard encoded = encode_shard(TerrainTile(2000, box), {});
  ASSERT_TRUE(IndexedChunks::of(encoded.file, box));
  EXPECT_EQ(decode_shard({encoded.file, 2000, box}, encoded.values_xxh3).nodes, TerrainTile(2000, box).nodes);
}

}  // namespace
}  // namespace btms
