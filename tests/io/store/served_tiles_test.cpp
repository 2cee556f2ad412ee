// Tiles as they are served, from the manifest alone.
#include "io/store/served_tiles.h"

#include <gtest/gtest.h>

namespace btms {
namespace {

Manifest manifest_of(std::int32_t edge, std::int32_t columns, std::int32_t rows) {
  Manifest manifest;
  manifest.info.layout = {Lattice(2000), {edge, {}}};
  for (std::int32_t tx = 0; tx < columns; ++tx)
    for (std::int32_t ty = 0; ty < rows; ++ty) {
      ShardEntry shard;
      shard.id = {tx, ty};
      shard.file = "x" + std::to_string(tx) + "_y" + std::to_string(ty) + ".r3.nc";
      shard.values_xxh3 = static_cast<std::uint64_t>(tx * 1000 + ty + 17);
      shard.tiles = {{shard.id, manifest.info.layout.grid.box_of(shard.id)}};
      manifest.shards.push_back(shard);
    }
  return manifest;
}

TEST(ServedTiles, LevelsUpToAFewTiles) {
  const ServedTiles tiles(manifest_of(128, 9, 5));
  ASSERT_EQ(tiles.levels().size(), 4u);
  EXPECT_EQ(tiles.levels()[0].tiles.size(), 45u);
  EXPECT_EQ(tiles.levels()[1].tiles.size(), 15u);
  EXPECT_EQ(tiles.levels()[2].tiles.size(), 6u);
  EXPECT_EQ(tiles.levels()[3].tiles.size(), 2u);
  EXPECT_EQ(tiles.levels()[3].cell_m, 16);
  EXPECT_EQ(tiles.bounds_m(), (std::array<double, 4>{0, 0, 9 * 256, 5 * 256}));
  EXPECT_EQ(tiles.bounds_m(1, {1, 2}), (std::array<double, 4>{512, 1024, 1024, 1536}));
  EXPECT_TRUE(tiles.find(0, {8, 4}));
  EXPECT_FALSE(tiles.find(0, {9, 4}));
  EXPECT_FALSE(tiles.inside(0, {9, 4}));
  EXPECT_FALSE(tiles.inside(4, {0, 0}));
  EXPECT_FALSE(tiles.inside(-1, {0, 0}));
  EXPECT_EQ(tiles.find(0, {8, 4})->revision, 3u);
}

TEST(ServedTiles, AnyStoredTiles) {
  EXPECT_EQ(ServedTiles(manifest_of(64, 4, 4)).levels()[0].tiles.size(), 4u);
  EXPECT_EQ(ServedTiles(manifest_of(300, 1, 1)).levels()[0].tiles.size(), 9u);
  EXPECT_TRUE(ServedTiles(Manifest{}).levels().empty());
}

TEST(ServedTiles, AnEtagIsThatOfTheContentBelow) {
  Manifest manifest = manifest_of(128, 9, 5);
  const ServedTiles before(manifest);
  ShardEntry& changed = manifest.shards[7];  // 1, 2
  changed.values_xxh3 ^= 1;
  changed.file = "x1_y2.r4.nc";
  const ServedTiles after(manifest);
  int differ = 0;
  for (std::size_t level = 0; level < before.levels().size(); ++level)
    for (const auto& [id, tile] : before.levels()[level].tiles) {
      const int l = static_cast<int>(level);
      const bool below = id == TileId{1 >> l, 2 >> l};
      EXPECT_EQ(before.etag(l, id, "elevation raw") != after.etag(l, id, "elevation raw"), below) << l;
      EXPECT_EQ(after.find(l, id)->revision, below ? 4u : 3u);
      differ += below;
    }
  EXPECT_EQ(differ, 4);
  EXPECT_NE(before.etag(0, {0, 0}, "elevation raw"), before.etag(0, {0, 0}, "elevation npy"));
  EXPECT_NE(before.etag(0, {0, 0}, "x"), before.etag(0, {0, 1}, "x"));
  EXPECT_EQ(before.etag(0, {0, 0}, "x").size(), 37u);
}

TEST(ServedTiles, Ids) {
  EXPECT_EQ(served_id(2, {-3, 4}), "2/-3/4");
  EXPECT_EQ(parse_served_id("2/-3/4"), (std::pair(2, TileId{-3, 4})));
  for (const char* bad :
       {"", "2", "2/3", "2/3/", "2/3/4/", "2//4", "02/3/4", "2/+3/4", "2/3/4 ", "2/99999999999/1", "a/b/c"})
    EXPECT_FALSE(parse_served_id(bad)) << bad;
}

}  // namespace
}  // namespace btms
