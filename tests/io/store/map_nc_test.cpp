// map.nc and shards as other programs read them: through plain HDF5 and its stock filters.
#include <hdf5.h>

#include "io/crs/crs.h"
#include "io/store/hdf5.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

template <class T>
std::vector<T> read_layer(const std::filesystem::path& file, const char* name, hid_t type) {
  const Hdf5File f(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), "open");
  const Hdf5Dataset d(H5Dopen2(f.get(), name, H5P_DEFAULT), "open");
  const Hdf5Space s(H5Dget_space(d.get()), "space");
  std::vector<T> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(s.get())));
  hdf5_check(H5Dread(d.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), "read");
  return values;
}

TEST(MapNc, ShowsEveryTileAtItsPlace) {
  const TemporaryFolder temporary;
  const CellBox cells{-100, -60, 210, 150};
  for (const int edge : {37, 64, 128, 400}) {
    const MapLayout layout = layout_of(2000, edge, edge == 400 ? Cell{-100, -60} : Cell{});
    const Tiles tiles = made_tiles(layout, cells, noisy_tile);
    write_map(temporary / "a.btms", layout, tiles);
    const auto file = temporary / "a.btms/map.nc";
    const auto x = read_layer<double>(file, "x", H5T_NATIVE_DOUBLE),
               y = read_layer<double>(file, "y", H5T_NATIVE_DOUBLE);
    ASSERT_EQ(x.size(), 310u);
    ASSERT_EQ(y.size(), 210u);
    EXPECT_EQ(x.front(), -199);
    EXPECT_EQ(y.front(), 299);
    EXPECT_EQ(y.back(), -119);
    const auto elevation = read_layer<float>(file, "elevation", H5T_NATIVE_FLOAT);
    const auto state = read_layer<std::uint8_t>(file, "tgf/state", H5T_NATIVE_UINT8);
    const auto count = read_layer<std::uint16_t>(file, "tgf/count", H5T_NATIVE_UINT16);
    const auto corner = read_layer<std::int32_t>(file, "tgf/corner_height", H5T_NATIVE_INT32);
    ASSERT_EQ(corner.size(), 311u * 211u);
    for (const auto& [id, tile] : tiles)
      for (std::int32_t row = tile.box.row0; row < tile.box.row1; ++row)
        for (std::int32_t col = tile.box.col0; col < tile.box.col1; ++col) {
          const auto line = static_cast<std::size_t>(cells.row1 - 1 - row),
                     column = static_cast<std::size_t>(col - cells.col0);
          const std::int32_t z_mm = tile.centre_mm[tile.cell_index({col, row})];
          const float z = elevation[line * 310 + column];
          if (z_mm == kUnknownHeight_mm)
            ASSERT_TRUE(std::isnan(z));
          else
            ASSERT_EQ(z, static_cast<float>(z_mm / 1000.0));
          ASSERT_EQ(corner[(line + 1) * 311 + column], tile.corner_mm[tile.corner_index({col, row})]);
          for (std::uint8_t t = 0; t < kTriangles; ++t) {
            const NodeSurface& node = tile.nodes[tile.node_index({{col, row}, t})];
            ASSERT_EQ(state[(t * 210 + line) * 310 + column], static_cast<std::uint8_t>(node.state));
            ASSERT_EQ(count[(t * 210 + line) * 310 + column], node.count);
          }
        }
  }
}

TEST(MapNc, GapsAreFilled) {
  const TemporaryFolder temporary;
  const MapLayout layout = layout_of(2000, 128);
  Tiles tiles;
  tiles.emplace(TileId{0, 0}, hilly_tile(layout, {10, 10, 20, 20}));
  tiles.emplace(TileId{2, 0}, hilly_tile(layout, {300, 10, 310, 20}));
  write_map(temporary / "a.btms", layout, tiles);
  const auto file = temporary / "a.btms/map.nc";
  EXPECT_TRUE(std::isnan(read_layer<float>(file, "elevation", H5T_NATIVE_FLOAT).at(150)));
  EXPECT_EQ(read_layer<std::uint8_t>(file, "class", H5T_NATIVE_UINT8).at(150), 255);
  EXPECT_EQ(read_layer<std::int32_t>(file, "tgf/centre_height", H5T_NATIVE_INT32).at(150), kUnknownHeight_mm);
}

TEST(MapNc, NamesOnlyUnitsThatItKnows) {
  // International metre, US survey foot, and Sears' chain.
  for (const auto& [crs, unit] : {std::pair("EPSG:25832", "m"), {"EPSG:2263", "US_survey_foot"}, {"EPSG:3167", ""}}) {
    const TemporaryFolder temporary;
    const MapLayout layout = layout_of(2000, 128);
    write_map(temporary / "a.btms", layout, made_tiles(layout, {0, 0, 5, 5}, noisy_tile), crs);
    const Hdf5File f(H5Fopen((temporary / "a.btms/map.nc").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), "open");
    ASSERT_EQ(H5Aexists_by_name(f.get(), "x", "units", H5P_DEFAULT) > 0, *unit != '\0') << crs;
    if (*unit == '\0') continue;
    const Hdf5Attribute a(H5Aopen_by_name(f.get(), "x", "units", H5P_DEFAULT, H5P_DEFAULT), "open");
    const Hdf5Type type(H5Aget_type(a.get()), "type");
    char text[64] = {};
    hdf5_check(H5Aread(a.get(), type.get(), text), "read");
    EXPECT_STREQ(text, unit) << crs;
  }
}

TEST(MapNc, ShardsReadWithTheStockFilters) {
  const TemporaryFolder temporary;
  const MapLayout layout = layout_of(2000, 300);
  const Tiles tiles = made_tiles(layout, {0, 0, 290, 133}, noisy_tile);
  write_map(temporary / "a.btms", layout, tiles);
  const auto centre =
      read_layer<std::int32_t>(temporary / "a.btms/shards/x0_y0.r1.nc", "tgf/centre_height", H5T_NATIVE_INT32);
  const TerrainTile& tile = tiles.begin()->second;
  for (std::int32_t row = 0; row < 133; ++row)
    for (std::int32_t col = 0; col < 290; ++col)
      ASSERT_EQ(centre[static_cast<std::size_t>((132 - row) * 290 + col)], tile.centre_mm[tile.cell_index({col, row})]);
}

}  // namespace
}  // namespace btms
