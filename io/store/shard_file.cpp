#include "io/store/shard_file.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "io/store/cf_file.h"
#include "io/store/chunk_codec.h"
#include "io/store/chunk_grid.h"
#include "io/store/chunk_index.h"
#include "io/store/hash.h"
#include "io/store/hdf5_chunks.h"
#include "io/store/shard_overview.h"
#include "io/store/upper_layers.h"

namespace btms {
namespace {

// Whether `bytes`, not empty, are nothing but copies of `value`.
bool is_filled_with(std::span<const std::uint8_t> bytes, std::span<const std::uint8_t> value) {
  return std::memcmp(bytes.data(), value.data(), value.size()) == 0 &&
         std::memcmp(bytes.data(), bytes.data() + value.size(), bytes.size() - value.size()) == 0;
}

struct Chunk {
  std::size_t row0, col0;
  std::vector<std::uint8_t> bytes;
};

// Chunks that hold nothing but the fill value are left out: HDF5 reads unwritten chunks as fill.
std::vector<Chunk> encode_layer(const LayerInfo& layer, const TerrainTile& tile, std::span<const std::uint8_t> raster,
                                ChunkEncoder& encoder) {
  const LayerShape shape = layer_shape(layer, tile.box, tile.upper.size());
  const LayerShape chunk = chunk_shape(layer, tile.box, tile.upper.size());
  const std::size_t element = element_bytes(layer.element);
  const std::vector<std::uint8_t> fill = fill_value(layer);
  std::vector<Chunk> out;
  const auto add = [&](std::size_t row0, std::size_t col0, std::span<const std::uint8_t> values) {
    if (!is_filled_with(values, fill)) out.push_back({row0, col0, encoder.encode(values, element)});
  };
  if (shape == chunk) {  // of most tiles
    add(0, 0, raster);
    return out;
  }
  std::vector<std::uint8_t> values(chunk.elements() * element);
  each_chunk(shape, chunk, [&](std::size_t row0, std::size_t col0) {
    fill_with(values, fill);
    each_chunk_row(shape, chunk, row0, col0, element, [&](std::size_t from, std::size_t to, std::size_t n) {
      std::memcpy(values.data() + to, raster.data() + from, n);
    });
    add(row0, col0, values);
  });
  return out;
}

void set_filters(const LayerInfo& layer, const TerrainTile& tile, hid_t properties) {
  const LayerShape c = chunk_shape(layer, tile.box, tile.upper.size());
  const std::array<hsize_t, 3> extent{c.planes, c.rows, c.cols};
  const int rank = dimensions(layer.raster);
  hdf5_check(H5Pset_chunk(properties, rank, extent.data() + (3 - rank)), "set chunks");
  if (element_bytes(layer.element) > 1) hdf5_check(H5Pset_shuffle(properties), "set shuffle");
  hdf5_check(H5Pset_deflate(properties, kDeflateLevel), "set deflate");
  hdf5_check(H5Pset_fletcher32(properties), "set fletcher32");
}

void add_places(hid_t dataset, const LayerInfo& layer, const TerrainTile& tile, std::vector<ChunkPlace>& places) {
  each_chunk(layer_shape(layer, tile.box, tile.upper.size()), chunk_shape(layer, tile.box, tile.upper.size()),
             [&](std::size_t row0, std::size_t col0) { places.push_back(hdf5_place(dataset, layer, row0, col0)); });
}

using Raster8 = std::vector<std::uint8_t>;

[[noreturn]] void damaged(const std::string& why) { throw Error(ErrorCode::kVerification, why); }

// A tile out of the layers in tgf, as they come.
class TileAssembly {
 public:
  explicit TileAssembly(const StoredShard& shard) : shard_(shard) {}

  void add(const LayerInfo& layer, std::size_t upper, std::span<const std::uint8_t> raster) {
    hash_ = xxh3_64(raster, hash_);
    if (layer.raster == Raster::kPerUpper) {
      listed_.resize(upper);
      return scatter_upper(layer, raster, listed_);
    }
    // Not before: the box is only the manifest's claim, now it is known that the file has layers of this shape.
    if (tile_.box.empty()) tile_ = TerrainTile(shard_.resolution_mm, shard_.box);
    scatter(layer, raster, tile_);
  }

  TerrainTile finish(std::optional<std::uint64_t> values_xxh3) {
    tile_.upper = unlist_upper(std::move(listed_), shard_.box);
    if (values_xxh3 && hash_ != *values_xxh3)
      damaged("values hash to " + hex64(hash_) + ", the manifest says " + hex64(*values_xxh3));
    return std::move(tile_);
  }

 private:
  const StoredShard shard_;
  TerrainTile tile_;
  std::vector<ListedUpper> listed_;
  std::uint64_t hash_ = 0;
};

std::size_t nodes_without_heights(const TerrainTile& tile) {
  std::size_t n = 0;
  for (std::int32_t row = tile.box.row0; row < tile.box.row1; ++row)
    for (std::int32_t col = tile.box.col0; col < tile.box.col1; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const NodeId id{{col, row}, t};
        if (tile.nodes[tile.node_index(id)].state == NodeState::kUnknown) continue;
        const auto heights = tile.corners_mm(id);
        n += std::find(heights.begin(), heights.end(), kUnknownHeight_mm) != heights.end();
      }
  return n;
}

}  // namespace

EncodedShard encode_shard(const TerrainTile& tile, const std::optional<Crs>& crs) {
  EncodedShard shard;
  ChunkEncoder encoder;
  const std::vector<ListedUpper> listed = list_upper(tile);
  std::vector<std::pair<const LayerInfo*, std::vector<Chunk>>> encoded;
  for (const LayerInfo& layer : layer_table()) {
    const bool list = layer.raster == Raster::kPerUpper;
    if (list && listed.empty()) continue;
    const std::vector<std::uint8_t> raster = list ? gather_upper(layer, listed) : gather(layer, tile);
    if (layer.in_tgf) shard.values_xxh3 = xxh3_64(raster, shard.values_xxh3);
    encoded.emplace_back(&layer, encode_layer(layer, tile, raster, encoder));
  }

  CfFile file(tile.box, tile.upper.size(), tile.resolution_mm, crs);
  std::vector<ChunkPlace> places;
  for (const auto& [info, chunks] : encoded) {
    const LayerInfo& layer = *info;
    Hdf5Dataset data = file.add_layer(layer, [&](hid_t p) { set_filters(layer, tile, p); });
    for (const Chunk& c : chunks)
      hdf5_check(H5Dwrite_chunk(data.get(), H5P_DEFAULT, 0, chunk_offset(layer, c.row0, c.col0).data(), c.bytes.size(),
                                c.bytes.data()),
                 "write a chunk");
    add_places(data.get(), layer, tile, places);
    data.close();
  }
  shard.file = file.finish();
  append_chunk_index(shard.file, tile.upper.size(), places, ShardOverview(tile).stored(), shard.values_xxh3);
  return shard;
}

TerrainTile decode_shard(const StoredShard& shard, std::uint64_t values_xxh3, const LayerReading& read) {
  TileAssembly assembly(shard);
  read(shard, Wanted::kModel, {},
       [&](const LayerInfo& layer, std::size_t upper, Raster8&& raster) { assembly.add(layer, upper, raster); });
  return assembly.finish(values_xxh3);
}

TerrainTile decode_shard_for_labels(const StoredShard& shard, const LayerReading& read) {
  TileAssembly assembly(shard);
  read(shard, Wanted::kLabels, {},
       [&](const LayerInfo& layer, std::size_t upper, Raster8&& raster) { assembly.add(layer, upper, raster); });
  return assembly.finish({});
}

TerrainTile check_shard(const StoredShard& shard, std::uint64_t values_xxh3, const std::optional<Crs>& crs,
                        const LayerReading& read) {
  TileAssembly assembly(shard);
  std::vector<std::pair<const LayerInfo*, Raster8>> derived;
  read(shard, Wanted::kAll, crs, [&](const LayerInfo& layer, std::size_t upper, Raster8&& raster) {
    if (layer.in_tgf)
      assembly.add(layer, upper, raster);
    else
      derived.emplace_back(&layer, std::move(raster));
  });
  TerrainTile tile = assembly.finish(values_xxh3);
  std::string wrong;
  if (IndexedChunks::of(shard.bytes, shard.box) &&
      !ShardOverview(shard.box, overview_in(shard.bytes)).is_same(ShardOverview(tile)))
    wrong = "its overview";
  for (const auto& [layer, raster] : derived)
    if (gather(*layer, tile) != raster) wrong.append(wrong.empty() ? "" : ", ").append(layer->name);
  if (!wrong.empty()) damaged("what is derived from the model differs from it in " + wrong);
  if (const std::size_t n = nodes_without_heights(tile); n > 0)
    damaged(std::to_string(n) + " nodes have a surface without heights");
  return tile;
}

}  // namespace btms
