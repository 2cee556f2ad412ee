#include "io/store/shard_file.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "io/store/cf_file.h"
#include "io/store/chunk_codec.h"
#include "io/store/hash.h"
#include "io/store/upper_layers.h"

namespace btms {
namespace {

// Rasters cut into chunks of equal shape; chunks that reach over the edge are filled up.

// Copies between a raster and one chunk, row by row: copy(raster bytes, chunk bytes, length) for the part both cover.
template <class Copy>
void each_chunk_row(const LayerShape& raster, const LayerShape& chunk, std::size_t row0, std::size_t col0,
                    std::size_t element, Copy&& copy) {
  const std::size_t rows = std::min(chunk.rows, raster.rows - row0), cols = std::min(chunk.cols, raster.cols - col0);
  for (std::size_t plane = 0; plane < raster.planes; ++plane)
    for (std::size_t row = 0; row < rows; ++row)
      copy(((plane * raster.rows + row0 + row) * raster.cols + col0) * element,
           (plane * chunk.rows + row) * chunk.cols * element, cols * element);
}

// Calls fn(row0, col0) for every chunk.
template <class Fn>
void each_chunk(const LayerShape& raster, const LayerShape& chunk, Fn&& fn) {
  for (std::size_t row0 = 0; row0 < raster.rows; row0 += chunk.rows)
    for (std::size_t col0 = 0; col0 < raster.cols; col0 += chunk.cols) fn(row0, col0);
}

// `bytes` filled with copies of `value`; doubling what is there beats copying single elements.
void fill_with(std::span<std::uint8_t> bytes, std::span<const std::uint8_t> value) {
  std::size_t done = std::min(value.size(), bytes.size());
  std::memcpy(bytes.data(), value.data(), done);
  for (; done < bytes.size(); done += std::min(done, bytes.size() - done))
    std::memcpy(bytes.data() + done, bytes.data(), std::min(done, bytes.size() - done));
}

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

std::array<hsize_t, 3> offsets(const LayerInfo& layer, std::size_t row0, std::size_t col0) {
  if (layer.raster == Raster::kPerTriangle) return {0, row0, col0};
  if (layer.raster == Raster::kPerUpper) return {col0, 0, 0};
  return {row0, col0, 0};
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

[[noreturn]] void damaged(const std::string& why) { throw Error(ErrorCode::kVerification, why); }

std::string dataset_name(const LayerInfo& layer) { return std::string(layer.in_tgf ? "tgf/" : "") + layer.name; }

// Entries of the lists of further surfaces: 0 where the shard has none. At most as many as the box can bear.
std::size_t count_upper(hid_t file, const CellBox& box) {
  const htri_t exists = hdf5_check(H5Lexists(file, "tgf/upper", H5P_DEFAULT), "look for a list");
  if (exists == 0) return 0;
  const Hdf5Dataset data(H5Dopen2(file, "tgf/upper", H5P_DEFAULT), "open a list");
  const Hdf5Space space(H5Dget_space(data.get()), "read a list's extent");
  const hssize_t n = hdf5_check(H5Sget_simple_extent_npoints(space.get()), "read a list's extent");
  const std::size_t most = static_cast<std::size_t>(box.cells()) * kTriangles * kMaxUpperPerNode;
  if (n < 1 || static_cast<std::size_t>(n) > most) damaged("list tgf/upper has an impossible length");
  return static_cast<std::size_t>(n);
}

// What a stored layer covers.
struct Extent {
  CellBox box;
  std::size_t upper;
  bool has(const LayerInfo& layer) const { return layer.in_tgf && (layer.raster != Raster::kPerUpper || upper > 0); }
};

// The stored layer; damaged() when it has not the shape it should have.
Hdf5Dataset open_layer(hid_t file, const LayerInfo& layer, const Extent& extent) {
  Hdf5Dataset data(H5Dopen2(file, dataset_name(layer).c_str(), H5P_DEFAULT), "open a layer");
  const Hdf5Space space(H5Dget_space(data.get()), "read a layer's extent");
  const Hdf5Space expected = layer_space(layer, layer_shape(layer, extent.box, extent.upper));
  const Hdf5Type type(H5Dget_type(data.get()), "read a layer's type");
  if (hdf5_check(H5Sextent_equal(space.get(), expected.get()), "compare extents") == 0 ||
      H5Tget_size(type.get()) != element_bytes(layer.element))
    damaged("layer " + dataset_name(layer) + " has another shape than the manifest says");
  return data;
}

// 0 for a chunk that was not written.
std::size_t stored_bytes(const Hdf5Dataset& data, const std::array<hsize_t, 3>& offset) {
  hsize_t size = 0;
  return H5Dget_chunk_storage_size(data.get(), offset.data(), &size) < 0 ? 0 : static_cast<std::size_t>(size);
}

// A long list takes memory, so it must be there: places ascend, hence no chunk is left out as nothing but fill (of
// place 0, more than a node bears), nor smaller than deflate can make it. damaged() otherwise.
void check_places_are_stored(hid_t file, const LayerInfo& places, const Extent& extent) {
  constexpr std::size_t kMostDeflated = 1032;  // bytes from one
  if (extent.upper <= kMaxUpperPerNode) return;
  Hdf5Dataset data = open_layer(file, places, extent);
  const LayerShape chunk = chunk_shape(places, extent.box, extent.upper);
  each_chunk(layer_shape(places, extent.box, extent.upper), chunk, [&](std::size_t row0, std::size_t col0) {
    if (stored_bytes(data, offsets(places, row0, col0)) * kMostDeflated <
        chunk.elements() * element_bytes(places.element))
      damaged("list tgf/upper is longer than what is stored of it");
  });
  data.close();
}

// The stored layer's raster; damaged() when it is not what encode_layer would have written.
std::vector<std::uint8_t> decode_layer(hid_t file, const LayerInfo& layer, const Extent& extent,
                                       ChunkDecoder& decoder) {
  Hdf5Dataset data = open_layer(file, layer, extent);
  const std::string name = dataset_name(layer);
  const LayerShape shape = layer_shape(layer, extent.box, extent.upper);
  const LayerShape chunk = chunk_shape(layer, extent.box, extent.upper);
  const std::size_t element = element_bytes(layer.element);
  std::vector<std::uint8_t> raster(shape.elements() * element), values(chunk.elements() * element), stored;
  fill_with(raster, fill_value(layer));
  each_chunk(shape, chunk, [&](std::size_t row0, std::size_t col0) {
    const auto offset = offsets(layer, row0, col0);
    const std::size_t size = stored_bytes(data, offset);
    if (size == 0) return;
    if (size > 2 * values.size() + 1024) damaged("a chunk of layer " + name + " is larger than it can be");
    stored.resize(size);
    std::uint32_t skipped_filters = 0;
    hdf5_check(H5Dread_chunk(data.get(), H5P_DEFAULT, offset.data(), &skipped_filters, stored.data()), "read a chunk");
    if (skipped_filters != 0 || !decoder.decode(stored, element, values))
      damaged("a chunk of layer " + name + " is damaged");
    each_chunk_row(shape, chunk, row0, col0, element, [&](std::size_t to, std::size_t from, std::size_t n) {
      std::memcpy(raster.data() + to, values.data() + from, n);
    });
  });
  data.close();
  return raster;
}

// The values of tgf/upper, sound; damaged() before anything of their number is allocated but themselves.
std::vector<std::uint8_t> decode_places(hid_t file, const Extent& extent, ChunkDecoder& decoder) {
  if (extent.upper == 0) return {};
  const auto table = layer_table();
  const auto places = std::find_if(table.begin(), table.end(), [](const auto& l) { return l.id == LayerId::kUpper; });
  check_places_are_stored(file, *places, extent);
  std::vector<std::uint8_t> values = decode_layer(file, *places, extent, decoder);
  if (!are_sound_places(values, extent.box)) damaged("list tgf/upper is out of order, or has too many of a place");
  return values;
}

bool is_for_labels(LayerId id) {
  return id == LayerId::kCornerHeight || id == LayerId::kCentreHeight || id == LayerId::kState ||
         id == LayerId::kTerrain;
}

// The tile that decode(file, extent, decoder) makes of a shard whose layers all have the right shape. The box is only
// the manifest's claim, so shapes come before the first allocation.
template <class Decode>
TerrainTile parse(std::span<const std::uint8_t> bytes, const CellBox& box, Decode&& decode) {
  const QuietHdf5 quiet;
  try {
    Hdf5File file = open_image(bytes);
    ChunkDecoder decoder;
    const Extent extent{box, count_upper(file.get(), box)};
    for (const LayerInfo& layer : layer_table())
      if (extent.has(layer)) open_layer(file.get(), layer, extent).close();
    TerrainTile tile = decode(file.get(), extent, decoder);
    file.close();
    return tile;
  } catch (const Error& e) {
    if (e.code() == ErrorCode::kVerification) throw;
    throw Error(ErrorCode::kVerification, e.what());
  }
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
  for (const auto& [info, chunks] : encoded) {
    const LayerInfo& layer = *info;
    Hdf5Dataset data = file.add_layer(layer, [&](hid_t p) { set_filters(layer, tile, p); });
    for (const Chunk& c : chunks)
      hdf5_check(H5Dwrite_chunk(data.get(), H5P_DEFAULT, 0, offsets(layer, c.row0, c.col0).data(), c.bytes.size(),
                                c.bytes.data()),
                 "write a chunk");
    data.close();
  }
  shard.file = file.finish();
  return shard;
}

TerrainTile decode_shard(std::span<const std::uint8_t> bytes, std::int32_t resolution_mm, const CellBox& box,
                         std::uint64_t values_xxh3) {
  return parse(bytes, box, [&](hid_t file, const Extent& extent, ChunkDecoder& decoder) {
    std::vector<std::uint8_t> places = decode_places(file, extent, decoder);
    TerrainTile tile(resolution_mm, box);
    std::vector<ListedUpper> listed(extent.upper);
    std::uint64_t hash = 0;
    for (const LayerInfo& layer : layer_table()) {
      if (!extent.has(layer)) continue;
      const std::vector<std::uint8_t> raster =
          layer.id == LayerId::kUpper ? std::move(places) : decode_layer(file, layer, extent, decoder);
      hash = xxh3_64(raster, hash);
      if (layer.raster == Raster::kPerUpper)
        scatter_upper(layer, raster, listed);
      else
        scatter(layer, raster, tile);
    }
    tile.upper = unlist_upper(std::move(listed), box);
    if (hash != values_xxh3) damaged("values hash to " + hex64(hash) + ", the manifest says " + hex64(values_xxh3));
    return tile;
  });
}

TerrainTile decode_shard_for_labels(std::span<const std::uint8_t> bytes, std::int32_t resolution_mm,
                                    const CellBox& box) {
  return parse(bytes, box, [&](hid_t file, const Extent& extent, ChunkDecoder& decoder) {
    TerrainTile tile(resolution_mm, box);
    for (const LayerInfo& layer : layer_table())
      if (is_for_labels(layer.id)) scatter(layer, decode_layer(file, layer, extent, decoder), tile);
    return tile;
  });
}

}  // namespace btms
