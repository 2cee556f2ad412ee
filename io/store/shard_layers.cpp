// What a shard holds: layers out of its chunks, which are decoded here, in the calling thread.
#include "io/store/shard_layers.h"

#include <algorithm>

#include "io/store/chunk_codec.h"
#include "io/store/chunk_grid.h"
#include "io/store/chunk_index.h"
#include "io/store/hdf5_chunks.h"
#include "io/store/upper_layers.h"

namespace btms {
namespace {

// A long list takes memory, so it must be there: places ascend, hence no chunk is left out as nothing but fill (of
// place 0, more than a node bears), nor smaller than deflate can make it. damaged_shard() otherwise.
void check_places_are_stored(StoredChunks& chunks, const LayerInfo& places, const CellBox& box) {
  constexpr std::size_t kMostDeflated = 1032;  // bytes from one
  if (chunks.upper() <= kMaxUpperPerNode) return;
  const LayerShape chunk = chunk_shape(places, box, chunks.upper());
  each_chunk(layer_shape(places, box, chunks.upper()), chunk, [&](std::size_t row0, std::size_t col0) {
    if (chunks.chunk(places, row0, col0).size() * kMostDeflated < chunk.elements() * element_bytes(places.element))
      damaged_shard("list tgf/upper is longer than what is stored of it");
  });
}

// The layer's raster; damaged_shard() when it is not what encode_layer would have written.
std::vector<std::uint8_t> decode_layer(StoredChunks& chunks, const LayerInfo& layer, const CellBox& box,
                                       ChunkDecoder& decoder) {
  const LayerShape shape = layer_shape(layer, box, chunks.upper());
  const LayerShape chunk = chunk_shape(layer, box, chunks.upper());
  const std::size_t element = element_bytes(layer.element);
  std::vector<std::uint8_t> raster(shape.elements() * element), values;
  fill_with(raster, fill_value(layer));
  each_chunk(shape, chunk, [&](std::size_t row0, std::size_t col0) {
    const std::span stored = chunks.chunk(layer, row0, col0);
    if (stored.empty()) return;
    const bool whole = shape == chunk;  // of most tiles
    if (!whole) values.resize(chunk.elements() * element);
    if (!decoder.decode(stored, element, whole ? raster : values))
      damaged_shard("a chunk of layer " + dataset_name(layer) + " is damaged");
    if (whole) return;
    each_chunk_row(shape, chunk, row0, col0, element, [&](std::size_t to, std::size_t from, std::size_t n) {
      std::memcpy(raster.data() + to, values.data() + from, n);
    });
  });
  return raster;
}

// The values of tgf/upper, sound; damaged_shard() before anything of their number is allocated but themselves.
std::vector<std::uint8_t> decode_places(StoredChunks& chunks, const CellBox& box, ChunkDecoder& decoder) {
  if (chunks.upper() == 0) return {};
  const auto table = layer_table();
  const auto places = std::find_if(table.begin(), table.end(), [](const auto& l) { return l.id == LayerId::kUpper; });
  check_places_are_stored(chunks, *places, box);
  std::vector<std::uint8_t> values = decode_layer(chunks, *places, box, decoder);
  if (!are_sound_places(values, box)) damaged_shard("list tgf/upper is out of order, or has too many of a place");
  return values;
}

void decode_layers(StoredChunks& chunks, const CellBox& box, Wanted wanted, const LayerSink& sink) {
  ChunkDecoder decoder;
  std::vector<std::uint8_t> places;
  if (wanted != Wanted::kLabels) places = decode_places(chunks, box, decoder);
  for (const LayerInfo& layer : layer_table())
    if (is_read(layer, wanted, chunks.upper()))
      sink(layer, chunks.upper(),
           layer.id == LayerId::kUpper ? std::move(places) : decode_layer(chunks, layer, box, decoder));
}

void check_index(const IndexedChunks& index, Hdf5Chunks& file, const CellBox& box) {
  if (index.upper() != file.upper()) damaged_shard("its index has other lists of further surfaces than its layers");
  for (const LayerInfo& layer : layer_table())
    if (is_read(layer, Wanted::kAll, file.upper()))
      each_chunk(layer_shape(layer, box, file.upper()), chunk_shape(layer, box, file.upper()),
                 [&](std::size_t row0, std::size_t col0) {
                   if (index.place(layer, row0, col0) != file.place(layer, row0, col0))
                     damaged_shard("its index has a chunk of layer " + dataset_name(layer) + " elsewhere than HDF5");
                 });
}

}  // namespace

bool is_read(const LayerInfo& layer, Wanted wanted, std::size_t upper) {
  if (wanted == Wanted::kLabels)
    return layer.id == LayerId::kCornerHeight || layer.id == LayerId::kCentreHeight || layer.id == LayerId::kState ||
           layer.id == LayerId::kTerrain;
  if (!layer.in_tgf) return wanted == Wanted::kAll;
  return layer.raster != Raster::kPerUpper || upper > 0;
}

void read_layers(const StoredShard& shard, Wanted wanted, const std::optional<Crs>& crs, const LayerSink& sink) {
  std::optional<IndexedChunks> index = IndexedChunks::of(shard.bytes, shard.box);
  if (index && wanted != Wanted::kAll) return decode_layers(*index, shard.box, wanted, sink);
  try {
    Hdf5Chunks file(shard, wanted, crs);
    if (index) check_index(*index, file, shard.box);
    decode_layers(file, shard.box, wanted, sink);
    file.close();
  } catch (const Error& e) {
    if (e.code() == ErrorCode::kVerification) throw;
    throw Error(ErrorCode::kVerification, e.what());
  }
}

}  // namespace btms
