#include "io/store/raster_nc.h"

#include <algorithm>
#include <cmath>

#include "io/store/cf_file.h"

namespace btms {
namespace {

constexpr unsigned kDeflateLevel = 4;
constexpr hsize_t kChunkEdge = 256;

void chunk(hid_t properties, const LayerInfo& layer, const CellBox& box) {
  const hsize_t extent[] = {std::min(static_cast<hsize_t>(box.rows()), kChunkEdge),
                            std::min(static_cast<hsize_t>(box.cols()), kChunkEdge)};
  hdf5_check(H5Pset_chunk(properties, 2, extent), "set chunks");
  if (element_bytes(layer.element) > 1) hdf5_check(H5Pset_shuffle(properties), "set shuffle");
  hdf5_check(H5Pset_deflate(properties, kDeflateLevel), "set deflate");
  hdf5_check(H5Pset_fletcher32(properties), "set checksums");
}

void write(Hdf5Dataset& data, const LayerInfo& layer, std::span<const float> values) {
  if (layer.element == Element::kF32) {
    hdf5_check(H5Dwrite(data.get(), H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), "write a layer");
    return;
  }
  const std::uint8_t nothing = fill_value(layer)[0];
  std::vector<std::uint8_t> bytes(values.size());
  std::transform(values.begin(), values.end(), bytes.begin(),
                 [&](float v) { return std::isnan(v) ? nothing : static_cast<std::uint8_t>(v); });
  hdf5_check(H5Dwrite(data.get(), H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()), "write a layer");
}

}  // namespace

std::vector<std::uint8_t> encode_raster_nc(const CellBox& box, std::int32_t edge_mm, const std::optional<Crs>& crs,
                                           std::span<const RasterValues> layers) {
  CfFile file(box, 0, edge_mm, crs);
  for (const RasterValues& raster : layers) {
    const auto layer = std::find_if(layer_table().begin(), layer_table().end(), [&](const LayerInfo& l) {
      return !l.in_tgf && l.raster == Raster::kPerSquare && l.name == raster.layer;
    });
    Hdf5Dataset data = file.add_layer(*layer, [&](hid_t properties) { chunk(properties, *layer, box); });
    write(data, *layer, raster.values);
    data.close();
  }
  return file.finish();
}

}  // namespace btms
