// What check_map() finds in maps that are not what they say.
#include "io/store/map_check.h"

#include <gmock/gmock.h>

#include <functional>
#include <sstream>

#include "io/store/hash.h"
#include "io/store/layers.h"
#include "io/store/map_folder.h"
#include "io/store/shard_file.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// Four shards around the origin.
class CheckedMap : public testing::Test {
 protected:
  void SetUp() override { write_map(folder_, layout_, tiles_, "EPSG:28992"); }

  // What three ranks find, too.
  MapCheck check(Trust trust = Trust::kTrusted) const {
    const Manifest manifest = read_manifest(folder_);
    const auto check_on = [&](Ranks& ranks) {
      Progress progress;
      return check_map(folder_, manifest, trust, *serial_threads(), ranks, progress);
    };
    const MapCheck found = check_on(*single_rank());
    run_forked_ranks(3, [&](Ranks& ranks) {
      if (all_of(check_on(ranks)) != all_of(found))
        throw Error(ErrorCode::kVerification, "rank " + std::to_string(ranks.rank()) + " finds something else");
    });
    return found;
  }
  static std::string all_of(const MapCheck& check) {
    std::ostringstream text;
    text << check.has_view << ' ' << check.bytes;
    for (const MapProblem& p : check.problems) text << '\n' << p.file << ' ' << tiles_text(p.tiles) << ' ' << p.what;
    for (const std::size_t shard : check.damaged) text << '\n' << shard;
    for (const std::string& stray : check.strays) text << '\n' << stray;
    return text.str();
  }
  fs::path shard_path(std::size_t s) const { return folder_ / "shards" / read_manifest(folder_).shards.at(s).file; }
  void flip(const fs::path& file, std::size_t at) const {
    std::string text = file_text(file);
    text.at(at) = static_cast<char>(text.at(at) ^ 1);
    write_text(file, text);
  }
  // What a writer with a fault, or a forger, leaves: any shard, and a manifest in agreement with its bytes.
  void forge(std::size_t s, const TerrainTile& content, const std::function<void(ShardEntry&)>& change = {}) {
    Manifest manifest = read_manifest(folder_);
    ShardEntry& entry = manifest.shards.at(s);
    const EncodedShard encoded = encode_shard(content, crs_);
    write_text(folder_ / "shards" / entry.file, {encoded.file.begin(), encoded.file.end()});
    entry.bytes = encoded.file.size();
    entry.file_xxh3 = xxh3_64(encoded.file);
    entry.values_xxh3 = encoded.values_xxh3;
    entry.digest = digest(content);
    if (change) change(entry);
    manifest.info.digest = {};
    for (const ShardEntry& shard : manifest.shards) manifest.info.digest += shard.digest;
    write_text(folder_ / "manifest.json", manifest_text(manifest));
  }
  const TerrainTile& content(std::size_t s) const { return tiles_.at(read_manifest(folder_).shards.at(s).id); }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_ / "a.btms";
  const MapLayout layout_ = layout_of(2000, 64);
  const Tiles tiles_ = made_tiles(layout_, {-40, -30, 50, 64}, hilly_tile);
  std::optional<Crs> crs_ = describe_crs("EPSG:28992");
};

void expect_one(const MapCheck& check, const std::string& file, const std::string& what) {
  ASSERT_EQ(check.problems.size(), 1u);
  EXPECT_THAT(check.problems[0].file, HasSubstr(file));
  EXPECT_THAT(check.problems[0].what, HasSubstr(what));
}

TEST_F(CheckedMap, ASoundMapHasNoProblems) {
  for (const Trust trust : {Trust::kTrusted, Trust::kUntrusted}) {
    const MapCheck found = check(trust);
    EXPECT_TRUE(found.problems.empty()) << found.problems[0].what;
    EXPECT_TRUE(found.has_view);
    EXPECT_TRUE(found.damaged.empty());
    EXPECT_TRUE(found.strays.empty());
    EXPECT_GT(found.bytes, 4000u);
  }
}

TEST_F(CheckedMap, ADamagedShardIsNamedWithItsTile) {
  flip(shard_path(2), 5000);
  const MapCheck found = check();
  expect_one(found, read_manifest(folder_).shards[2].file, "file hashes to");
  EXPECT_EQ(found.problems[0].tiles, std::vector<TileId>{(read_manifest(folder_).shards[2].id)});
  EXPECT_EQ(found.damaged, std::set<std::size_t>{2});
}

TEST_F(CheckedMap, MissingAndSwappedShardsAreNamed) {
  fs::remove(shard_path(0));
  expect_one(check(), "shards/", "missing");
  write_map(folder_, layout_, tiles_);
  const fs::path a = shard_path(1), b = shard_path(3);
  fs::rename(a, temporary_ / "aside");
  fs::rename(b, a);
  fs::rename(temporary_ / "aside", b);
  EXPECT_EQ(check().damaged, (std::set<std::size_t>{1, 3}));
}

TEST_F(CheckedMap, AViewThatIsDamagedMissingOrAnotherMapsIsNamed) {
  const std::string good = file_text(folder_ / "map.nc");
  for (std::size_t at = 0; at < good.size(); at += good.size() / 7) {
    flip(folder_ / "map.nc", at);
    const MapCheck found = check();
    expect_one(found, "map.nc", "is not the view");
    EXPECT_FALSE(found.has_view);
    write_text(folder_ / "map.nc", good);
  }
  fs::remove(folder_ / "map.nc");
  expect_one(check(), "map.nc", "missing");
  fs::create_directory(folder_ / "map.nc");
  expect_one(check(), "map.nc", "not a regular file");
}

TEST_F(CheckedMap, StraysAreListedAndNoProblem) {
  write_text(folder_ / "notes.txt", "mine");
  write_text(folder_ / "shards" / "x9_y9.r7.nc", "left by a killed build");
  const MapCheck found = check();
  EXPECT_TRUE(found.problems.empty());
  EXPECT_EQ(found.strays, (std::vector<std::string>{"notes.txt"}));
}

TEST_F(CheckedMap, ValuesAndDigestAreComparedThoughTheFileIsAsStated) {
  forge(1, content(1), [](ShardEntry& entry) { ++entry.values_xxh3; });
  expect_one(check(), "shards/", "values hash to");
  forge(1, content(1), [](ShardEntry& entry) { ++entry.digest.low; });
  expect_one(check(), "shards/", "digest");
}

TEST_F(CheckedMap, HeightsMustAgreeOnBordersBetweenShards) {
  for (std::size_t s = 0; s < 4; ++s) {
    TerrainTile changed = content(s);
    // The corner where all four meet.
    changed.corner_mm[changed.corner_index({0, 0})] += 7;
    forge(s, changed);
    const MapCheck found = check();
    EXPECT_EQ(found.problems.size(), 3u);  // with each of the others, diagonal neighbours included
    for (const MapProblem& problem : found.problems) {
      EXPECT_THAT(problem.what, HasSubstr("about 1 corner heights on their border, first at 0.000,0.000 m"));
      EXPECT_EQ(problem.tiles.size(), 2u);
    }
    forge(s, content(s));
  }
  // A height that one side leaves out is no contradiction.
  TerrainTile changed = content(0);
  for (std::size_t t = 0; t < changed.nodes.size(); ++t) changed.nodes[t] = {};
  std::fill(changed.corner_mm.begin(), changed.corner_mm.end(), kUnknownHeight_mm);
  forge(0, changed);
  EXPECT_TRUE(check().problems.empty());
}

TEST_F(CheckedMap, ASurfaceNeedsHeights) {
  TerrainTile changed = content(0);
  changed.nodes[0].state = NodeState::kObserved;
  changed.centre_mm[0] = kUnknownHeight_mm;
  forge(0, changed);
  expect_one(check(), "shards/", "without heights");
}

TEST_F(CheckedMap, AnotherPlaceOrReferenceSystemIsNoticed) {
  crs_ = describe_crs("EPSG:32633");
  forge(0, content(0));
  expect_one(check(), "shards/", "reference system");
  crs_.reset();
  forge(0, content(0));
  expect_one(check(), "shards/", "reference system");
}

// The lists of layers and the axes, by files whose root layers or axes say something else than the model.
TEST_F(CheckedMap, WhatIsDerivedMustFollowFromTheModel) {
  TerrainTile model = content(0), other = model;
  other.centre_mm[5] = 12345;
  std::vector<std::string> layers;
  const EncodedShard encoded = encode_shard(model, crs_);
  const LayerReading lie = [&](const StoredShard& shard, Wanted wanted, const std::optional<Crs>& crs,
                               const LayerSink& sink) {
    read_layers(shard, wanted, crs, [&](const LayerInfo& layer, std::size_t upper, std::vector<std::uint8_t>&& r) {
      sink(layer, upper, layer.in_tgf ? std::move(r) : gather(layer, other));
    });
  };
  try {
    check_shard({encoded.file, 2000, model.box}, encoded.values_xxh3, crs_, lie);
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("derived from the model differs from it in elevation"));
  }
  // The same shape, one square further east.
  CellBox moved = model.box;
  ++moved.col0, ++moved.col1;
  try {
    check_shard({encoded.file, 2000, moved}, encoded.values_xxh3, crs_);
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("axis x lies elsewhere"));
  }
}

}  // namespace
}  // namespace btms
