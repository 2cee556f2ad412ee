// What a repair puts back, and that it touches nothing else.
#include "io/store/map_repair.h"

#include "io/store/hash.h"
#include "io/store/map_folder.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

class RepairedMap : public testing::Test {
 protected:
  void SetUp() override { write_map(folder_, layout_, tiles_, "EPSG:28992"); }

  MapCheck check() const {
    Progress progress;
    return check_map(folder_, read_manifest(folder_), Trust::kTrusted, *serial_threads(), *single_rank(), progress);
  }
  fs::path shard_path(std::size_t s) const { return folder_ / "shards" / read_manifest(folder_).shards.at(s).file; }
  std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
      if (entry.is_regular_file()) all[entry.path().string()] = file_text(entry.path());
    return all;
  }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_ / "a.btms";
  // Blocks of 2 x 2 tiles a shard.
  const MapLayout layout_ = layout_of(2000, 32);
  const Tiles tiles_ = made_tiles(layout_, {-40, -30, 50, 64}, hilly_tile);
};

TEST_F(RepairedMap, WhatComesFromABuildIsPutBackByteForByte) {
  const auto before = files();
  fs::remove(shard_path(1));
  write_text(shard_path(3), "nothing like a shard");
  fs::remove(folder_ / "map.nc");
  const MapCheck found = check();
  ASSERT_EQ(found.damaged, (std::set<std::size_t>{1, 3}));
  const auto intact_since = fs::last_write_time(shard_path(0));
  {
    MapRepair repair(folder_, read_manifest(folder_), found);
    TileSink& sink = repair.sink(layout_);
    for (const auto& [id, tile] : tiles_) EXPECT_EQ(sink.put(id, TerrainTile(tile)), digest(tile));
    EXPECT_TRUE(repair.missing().empty());
    repair.finish();
  }
  EXPECT_EQ(files(), before);
  EXPECT_EQ(fs::last_write_time(shard_path(0)), intact_since);
  EXPECT_TRUE(check().problems.empty());
}

TEST_F(RepairedMap, OtherValuesAreNotPutBack) {
  fs::remove(shard_path(1));
  const TileId lost = read_manifest(folder_).shards[1].tiles[0].id;
  const MapCheck found = check();
  MapRepair repair(folder_, read_manifest(folder_), found);
  TileSink& sink = repair.sink(layout_);
  for (const auto& [id, tile] : tiles_) {
    TerrainTile changed = tile;
    if (id == lost) ++changed.nodes[0].sd_mm;
    sink.put(id, std::move(changed));
  }
  EXPECT_EQ(repair.missing(), std::set<std::size_t>{1});
  repair.finish();
  EXPECT_EQ(check().damaged, std::set<std::size_t>{1});
  EXPECT_EQ(thrown_code([&] { repair.sink(layout_of(2000, 16)); }), ErrorCode::kBadInput);
}

TEST_F(RepairedMap, DamageToDerivedLayersIsUndoneFromTheShardItself) {
  // The root layers come first in the file, the model after them.
  const std::string good = file_text(shard_path(0));
  int restored = 0;
  for (std::size_t at = 100; at < good.size(); at += good.size() / 40) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 4);
    write_text(shard_path(0), bad);
    const Manifest manifest = read_manifest(folder_);
    const auto content = salvage_shard(folder_, manifest, 0);
    if (!content) continue;
    MapRepair repair(folder_, manifest, check());
    ASSERT_TRUE(repair.put_back(0, *content));
    repair.finish();
    EXPECT_EQ(file_text(shard_path(0)), good) << at;
    ++restored;
  }
  EXPECT_GT(restored, 3);
  EXPECT_LT(restored, 40);
}

// As if another version of the compressor had written the map.
TEST_F(RepairedMap, EqualValuesInOtherBytesMakeANewRevision) {
  Manifest manifest = read_manifest(folder_);
  const fs::path old_file = shard_path(2);
  std::string text = file_text(old_file) + "x";
  manifest.shards[2].bytes = text.size();
  manifest.shards[2].file_xxh3 = xxh3_64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  write_text(folder_ / "manifest.json", manifest_text(manifest));
  text[text.size() / 3] = static_cast<char>(text[text.size() / 3] ^ 1);
  write_text(old_file, text);
  const auto others = files_in(folder_ / "shards").size();
  const MapCheck found = check();
  ASSERT_EQ(found.damaged, std::set<std::size_t>{2});
  {
    MapRepair repair(folder_, manifest, found);
    TileSink& sink = repair.sink(layout_);
    for (const auto& [id, tile] : tiles_) sink.put(id, TerrainTile(tile));
    repair.finish();
  }
  const Manifest repaired = read_manifest(folder_);
  EXPECT_EQ(repaired.info.revision, manifest.info.revision + 1);
  EXPECT_EQ(repaired.info.digest, manifest.info.digest);
  EXPECT_EQ(repaired.shards[0].file, manifest.shards[0].file);
  EXPECT_EQ(files_in(folder_ / "shards").size(), others + 1);  // the old one until the next publish
  EXPECT_TRUE(check().problems.empty());
}

TEST_F(RepairedMap, ABuildAndARepairKeepOutOfEachOthersWay) {
  const MapCheck found = check();
  const Manifest manifest = read_manifest(folder_);
  {
    const auto writer = MapWriter::create(folder_, layout_);
    EXPECT_EQ(thrown_code([&] { MapRepair(folder_, manifest, found); }), ErrorCode::kFailed);
  }
  write_map(folder_, layout_, tiles_);  // the next revision
  EXPECT_EQ(thrown_code([&] { MapRepair(folder_, manifest, found); }), ErrorCode::kFailed);
}

}  // namespace
}  // namespace btms
