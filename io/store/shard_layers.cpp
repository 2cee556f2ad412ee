// HDF5 on shards: shapes first, then chunks, which are decoded without it.
#include "io/store/shard_layers.h"

#include <algorithm>

#include "io/store/cf_file.h"
#include "io/store/chunk_codec.h"
#include "io/store/chunk_grid.h"
#include "io/store/upper_layers.h"

namespace btms {
namespace {

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
    if (stored_bytes(data, chunk_offset(places, row0, col0)) * kMostDeflated <
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
    const auto offset = chunk_offset(layer, row0, col0);
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

void check_axis(hid_t file, const CfAxisValues& expected) {
  Hdf5Dataset data(H5Dopen2(file, expected.dataset.c_str(), H5P_DEFAULT), "open an axis");
  const Hdf5Space space(H5Dget_space(data.get()), "read an axis' extent");
  std::vector<double> found(expected.values.size());
  if (H5Sget_simple_extent_npoints(space.get()) != static_cast<hssize_t>(found.size()))
    damaged("axis " + expected.dataset + " has another length than its layers");
  hdf5_check(H5Dread(data.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, found.data()), "read an axis");
  if (found != expected.values) damaged("axis " + expected.dataset + " lies elsewhere than the manifest says");
  data.close();
}

// The text of crs:crs_wkt; empty where the file has no reference system.
std::string stored_wkt(hid_t file) {
  constexpr std::size_t kMost_bytes = 1 << 20;
  if (hdf5_check(H5Lexists(file, "crs", H5P_DEFAULT), "look for crs") == 0) return {};
  Hdf5Attribute text(H5Aopen_by_name(file, "crs", "crs_wkt", H5P_DEFAULT, H5P_DEFAULT), "open crs_wkt");
  const Hdf5Type type(H5Aget_type(text.get()), "read a type");
  const Hdf5Space space(H5Aget_space(text.get()), "read an extent");
  const std::size_t size = H5Tget_size(type.get());
  if (H5Tget_class(type.get()) != H5T_STRING || H5Tis_variable_str(type.get()) != 0 || size == 0 ||
      size > kMost_bytes || H5Sget_simple_extent_npoints(space.get()) != 1)
    damaged("crs_wkt is no text");
  std::string wkt(size, '\0');
  hdf5_check(H5Aread(text.get(), type.get(), wkt.data()), "read crs_wkt");
  wkt.resize(std::min(wkt.find('\0'), size));
  return wkt;
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
  const QuietHdf5 quiet;
  try {
    Hdf5File file = open_image(shard.bytes);
    ChunkDecoder decoder;
    const Extent extent{shard.box, count_upper(file.get(), shard.box)};
    // The box is only the manifest's claim, so shapes come before the first allocation.
    for (const LayerInfo& layer : layer_table())
      if (is_read(layer, wanted, extent.upper)) open_layer(file.get(), layer, extent).close();
    if (wanted == Wanted::kAll) {
      for (const CfAxisValues& axis : cf_axes(shard.box, shard.resolution_mm, crs)) check_axis(file.get(), axis);
      if (stored_wkt(file.get()) != (crs ? crs->wkt : "")) damaged("its reference system is not the manifest's");
    }
    std::vector<std::uint8_t> places;
    if (wanted != Wanted::kLabels) places = decode_places(file.get(), extent, decoder);
    for (const LayerInfo& layer : layer_table())
      if (is_read(layer, wanted, extent.upper))
        sink(layer, extent.upper,
             layer.id == LayerId::kUpper ? std::move(places) : decode_layer(file.get(), layer, extent, decoder));
    file.close();
  } catch (const Error& e) {
    if (e.code() == ErrorCode::kVerification) throw;
    throw Error(ErrorCode::kVerification, e.what());
  }
}

}  // namespace btms
