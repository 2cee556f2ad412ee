#include "io/store/hdf5_chunks.h"

#include <algorithm>

#include "io/store/cf_file.h"
#include "io/store/chunk_grid.h"

namespace btms {
namespace {

std::size_t count_upper(hid_t file, const CellBox& box) {
  const htri_t exists = hdf5_check(H5Lexists(file, "tgf/upper", H5P_DEFAULT), "look for a list");
  if (exists == 0) return 0;
  const Hdf5Dataset data(H5Dopen2(file, "tgf/upper", H5P_DEFAULT), "open a list");
  const Hdf5Space space(H5Dget_space(data.get()), "read a list's extent");
  const hssize_t n = hdf5_check(H5Sget_simple_extent_npoints(space.get()), "read a list's extent");
  if (n < 1 || static_cast<std::size_t>(n) > most_upper(box)) damaged_shard("list tgf/upper has an impossible length");
  return static_cast<std::size_t>(n);
}

void check_axis(hid_t file, const CfAxisValues& expected) {
  Hdf5Dataset data(H5Dopen2(file, expected.dataset.c_str(), H5P_DEFAULT), "open an axis");
  const Hdf5Space space(H5Dget_space(data.get()), "read an axis' extent");
  std::vector<double> found(expected.values.size());
  if (H5Sget_simple_extent_npoints(space.get()) != static_cast<hssize_t>(found.size()))
    damaged_shard("axis " + expected.dataset + " has another length than its layers");
  hdf5_check(H5Dread(data.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, found.data()), "read an axis");
  if (found != expected.values) damaged_shard("axis " + expected.dataset + " lies elsewhere than the manifest says");
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
    damaged_shard("crs_wkt is no text");
  std::string wkt(size, '\0');
  hdf5_check(H5Aread(text.get(), type.get(), wkt.data()), "read crs_wkt");
  wkt.resize(std::min(wkt.find('\0'), size));
  return wkt;
}

}  // namespace

ChunkPlace hdf5_place(hid_t dataset, const LayerInfo& layer, std::size_t row0, std::size_t col0) {
  haddr_t offset = HADDR_UNDEF;
  hsize_t size = 0;
  hdf5_check(H5Dget_chunk_info_by_coord(dataset, chunk_offset(layer, row0, col0).data(), nullptr, &offset, &size),
             "find a chunk");
  if (offset == HADDR_UNDEF || size == 0) return {};
  return {offset, size};
}

Hdf5Chunks::Hdf5Chunks(const StoredShard& shard, Wanted wanted, const std::optional<Crs>& crs)
    : box_(shard.box), file_(open_image(shard.bytes)), upper_(count_upper(file_.get(), shard.box)) {
  // The box is only the manifest's claim, so shapes come before the first allocation.
  for (const LayerInfo& layer : layer_table())
    if (is_read(layer, wanted, upper_)) open_layer(layer).close();
  if (wanted != Wanted::kAll) return;
  for (const CfAxisValues& axis : cf_axes(shard.box, shard.resolution_mm, crs)) check_axis(file_.get(), axis);
  if (stored_wkt(file_.get()) != (crs ? crs->wkt : "")) damaged_shard("its reference system is not the manifest's");
}

// damaged_shard() when the layer has not the shape it should have.
Hdf5Dataset Hdf5Chunks::open_layer(const LayerInfo& layer) const {
  Hdf5Dataset data(H5Dopen2(file_.get(), dataset_name(layer).c_str(), H5P_DEFAULT), "open a layer");
  const Hdf5Space space(H5Dget_space(data.get()), "read a layer's extent");
  const Hdf5Space expected = layer_space(layer, layer_shape(layer, box_, upper_));
  const Hdf5Type type(H5Dget_type(data.get()), "read a layer's type");
  if (hdf5_check(H5Sextent_equal(space.get(), expected.get()), "compare extents") == 0 ||
      H5Tget_size(type.get()) != element_bytes(layer.element))
    damaged_shard("layer " + dataset_name(layer) + " has another shape than the manifest says");
  return data;
}

const Hdf5Dataset& Hdf5Chunks::opened(const LayerInfo& layer) {
  if (layer_ != &layer) {
    dataset_.close();
    dataset_ = open_layer(layer);
    layer_ = &layer;
  }
  return dataset_;
}

std::span<const std::uint8_t> Hdf5Chunks::chunk(const LayerInfo& layer, std::size_t row0, std::size_t col0) {
  const hid_t data = opened(layer).get();
  const auto offset = chunk_offset(layer, row0, col0);
  hsize_t size = 0;
  if (H5Dget_chunk_storage_size(data, offset.data(), &size) < 0 || size == 0) return {};  // it was not written
  const std::size_t chunk_bytes = chunk_shape(layer, box_, upper_).elements() * element_bytes(layer.element);
  if (size > 2 * chunk_bytes + 1024)
    damaged_shard("a chunk of layer " + dataset_name(layer) + " is larger than it can be");
  stored_.resize(size);
  std::uint32_t skipped_filters = 0;
  hdf5_check(H5Dread_chunk(data, H5P_DEFAULT, offset.data(), &skipped_filters, stored_.data()), "read a chunk");
  if (skipped_filters != 0) damaged_shard("a chunk of layer " + dataset_name(layer) + " is damaged");
  return stored_;
}

ChunkPlace Hdf5Chunks::place(const LayerInfo& layer, std::size_t row0, std::size_t col0) {
  return hdf5_place(opened(layer).get(), layer, row0, col0);
}

void Hdf5Chunks::close() {
  dataset_.close();
  layer_ = nullptr;
  file_.close();
}

}  // namespace btms
