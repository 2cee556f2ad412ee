// Layers as they are stored, read by themselves.
#include <gtest/gtest.h>

#include <bit>
#include <cstring>

#include "io/export/raster.h"
#include "io/export/raw_tile.h"
#include "io/store/chunk_codec.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

class StoredRasters : public testing::Test {
 protected:
  void write(std::int32_t edge, const CellBox& cells) {
    layout_ = layout_of(2000, edge);
    write_map(folder_, layout_, made_tiles(layout_, cells, noisy_tile));
    map_ = MapReader::open(folder_);
  }
  static std::vector<float> decoded(const StoredRaster& raster) {
    const auto n = static_cast<std::size_t>(raster.box.cells());
    std::vector<std::uint8_t> bytes(n * raster.element_bytes);
    EXPECT_TRUE(ChunkDecoder().decode(raster.bytes, raster.element_bytes, bytes));
    std::vector<float> values(n);
    if (raster.element_bytes == 4)
      std::memcpy(values.data(), bytes.data(), bytes.size());
    else
      for (std::size_t i = 0; i < n; ++i) values[i] = bytes[i];
    return values;
  }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_ / "a.btms";
  MapLayout layout_;
  std::unique_ptr<MapReader> map_;
};

TEST_F(StoredRasters, HaveTheValuesOfWindows) {
  for (const std::int32_t edge : {128, 64, 100}) {
    write(edge, {-140, -20, 170, 131});
    std::vector<const RasterLayer*> layers;
    for (const RasterLayer& layer : raster_layers()) layers.push_back(&layer);
    for (const TileId id : map_->tiles()) {
      const Window window = cut_window(*map_, 0, map_->load(id)->box, layers);
      for (std::size_t l = 0; l < layers.size(); ++l) {
        const auto stored = map_->stored_raster(id, layers[l]->name);
        ASSERT_TRUE(stored);
        EXPECT_EQ(stored->element_bytes, layers[l]->name == "class" ? 1u : 4u);
        const std::vector<float> values = decoded(*stored);
        ASSERT_EQ(values.size(), window.values[l].size());
        EXPECT_EQ(std::memcmp(values.data(), window.values[l].data(), values.size() * sizeof(float)), 0)
            << layers[l]->name;
      }
    }
    EXPECT_FALSE(map_->stored_raster({99, 99}, "elevation"));
  }
}

TEST_F(StoredRasters, AreNotOfTilesInPieces) {
  write(256, {0, 0, 256, 200});
  EXPECT_FALSE(map_->stored_raster({0, 0}, "elevation"));
  write(32, {0, 0, 64, 64});
  EXPECT_FALSE(map_->stored_raster({0, 0}, "elevation"));
  write(128, {0, 0, 128, 128});
  EXPECT_FALSE(MapReader::open(folder_, Trust::kUntrusted)->stored_raster({0, 0}, "elevation"));
}

TEST_F(StoredRasters, DamageIsNoticedWhereItIsRead) {
  write(128, {0, 0, 128, 128});
  const fs::path shard = files_in(folder_ / "shards").at(0);
  const std::string good = file_text(shard);
  const auto sound = map_->stored_raster({0, 0}, "elevation");
  int refused = 0;
  for (std::size_t at = 1; at < good.size(); at += good.size() / 150) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x20);
    write_text(shard, bad);
    try {
      const auto found = map_->stored_raster({0, 0}, "elevation");
      EXPECT_TRUE(!found || found->bytes == sound->bytes) << at;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kVerification);
      EXPECT_NE(std::string(e.what()).find("tile 0,0 is damaged"), std::string::npos);
      ++refused;
    }
  }
  EXPECT_GT(refused, 3);
  write_text(shard, good.substr(1));
  EXPECT_EQ(thrown_code([&] { map_->stored_raster({0, 0}, "elevation"); }), ErrorCode::kVerification);
}

TEST_F(StoredRasters, AsTilesHaveAHeader) {
  write(128, {-30, 5, 100, 120});
  const auto stored = map_->stored_raster({-1, 0}, "elevation");
  const std::vector<std::uint8_t> tile = chunk_tile(*stored, {-1, 0}, 2);
  std::uint16_t type = 0;
  std::uint32_t rows = 0, cols = 0;
  double min_x_m = 0, min_y_m = 0;
  std::memcpy(&type, tile.data() + 12, sizeof type);
  std::memcpy(&rows, tile.data() + 24, sizeof rows);
  std::memcpy(&cols, tile.data() + 28, sizeof cols);
  std::memcpy(&min_x_m, tile.data() + 32, sizeof min_x_m);
  std::memcpy(&min_y_m, tile.data() + 40, sizeof min_y_m);
  EXPECT_EQ(type, 2);
  EXPECT_EQ(rows, 115u);
  EXPECT_EQ(cols, 30u);
  EXPECT_EQ(min_x_m, -60);
  EXPECT_EQ(min_y_m, 10);
  EXPECT_TRUE(std::equal(stored->bytes.begin(), stored->bytes.end(), tile.begin() + 64, tile.end()));
  EXPECT_EQ(thrown_code([&] { parse_raw_tile(tile); }), ErrorCode::kBadInput);  // not a raw one
}

}  // namespace
}  // namespace btms
