#include "io/store/map_nc.h"

#include "io/store/cf_file.h"
#include "io/store/map_folder.h"

namespace btms {
namespace {

// Shows a shard's whole layer at its place in the map's.
void map_shard(hid_t properties, const LayerInfo& layer, const CellBox& map, const ShardEntry& shard) {
  const CellBox box = shard.bounds();
  const LayerShape part = layer_shape(layer, box, 0);
  const Hdf5Space source = layer_space(layer, part), target = layer_space(layer, layer_shape(layer, map, 0));
  const hsize_t start[] = {0, static_cast<hsize_t>(std::int64_t{map.row1} - box.row1),
                           static_cast<hsize_t>(std::int64_t{box.col0} - map.col0)};
  const hsize_t count[] = {part.planes, part.rows, part.cols};
  const int skip = 3 - dimensions(layer.raster);
  hdf5_check(H5Sselect_hyperslab(target.get(), H5S_SELECT_SET, start + skip, nullptr, count + skip, nullptr),
             "select a shard's place");
  const std::string file = std::string(kShardFolder) + "/" + shard.file;
  const std::string dataset = std::string(layer.in_tgf ? "/tgf/" : "/") + layer.name;
  hdf5_check(H5Pset_virtual(properties, target.get(), file.c_str(), dataset.c_str(), source.get()), "map a shard");
}

}  // namespace

std::vector<std::uint8_t> encode_map_nc(std::int32_t resolution_mm, const std::vector<ShardEntry>& shards,
                                        const std::optional<Crs>& crs) {
  CellBox map;
  for (const ShardEntry& s : shards) map = map.hull(s.bounds());
  if (map.empty() || map.cols() > kMaxMapSide_cells || map.rows() > kMaxMapSide_cells) return {};
  CfFile file(map, 0, resolution_mm, crs);
  for (const LayerInfo& layer : layer_table()) {
    if (layer.raster == Raster::kPerUpper) continue;  // indices count inside a shard
    Hdf5Dataset data = file.add_layer(layer, [&](hid_t p) {
      for (const ShardEntry& s : shards) map_shard(p, layer, map, s);
    });
    data.close();
  }
  return file.finish();
}

}  // namespace btms
