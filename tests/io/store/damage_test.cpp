// Damaged maps are noticed, and never crash a reader.
#include <sys/resource.h>

#include <chrono>
#include <random>

#include "io/store/hash.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

class DamagedMap : public testing::Test {
 protected:
  ErrorCode open_code() const {
    return thrown_code([&] { MapReader::open(folder_); });
  }
  // A manifest with text replaced and its hash made right again.
  void forge(const std::string& from, const std::string& to) {
    std::string text = pristine_;
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    rehash(text);
    write_text(manifest_, text);
  }
  static void rehash(std::string& text) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
    text.replace(9, 16, hex64(xxh3_64({bytes + 25, text.size() - 25})));
  }

  const TemporaryFolder temporary_;
  const MapLayout layout_ = layout_of(2000, 128);
  const fs::path folder_ = temporary_ / "a.btms", manifest_ = folder_ / "manifest.json";
  const std::string pristine_ = [this] {
    write_map(folder_, layout_, made_tiles(layout_, {0, 0, 40, 30}, hilly_tile));
    return file_text(manifest_);
  }();
};

TEST_F(DamagedMap, EveryFlippedByteOfAShardIsNoticed) {
  const fs::path shard = files_in(folder_ / "shards").at(0);
  const std::string good = file_text(shard);
  for (std::size_t at = 0; at < good.size(); at += 97) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x10);
    write_text(shard, bad);
    EXPECT_EQ(thrown_code([&] { MapReader::open(folder_)->load({0, 0}); }), ErrorCode::kVerification) << at;
  }
}

TEST_F(DamagedMap, ShortLongAndMissingShardsAreNoticed) {
  const fs::path shard = files_in(folder_ / "shards").at(0);
  const std::string good = file_text(shard);
  const auto load = [&] { MapReader::open(folder_)->load({0, 0}); };
  for (const std::string& bad : {good.substr(0, good.size() - 1), good + "x", std::string()}) {
    write_text(shard, bad);
    EXPECT_EQ(thrown_code(load), ErrorCode::kVerification);
  }
  fs::remove(shard);
  EXPECT_EQ(thrown_code(load), ErrorCode::kVerification);
  fs::create_directory(shard);
  EXPECT_EQ(thrown_code(load), ErrorCode::kVerification);
}

TEST_F(DamagedMap, TruncatedManifestsAreBadInput) {
  for (std::size_t n = 0; n + 2 < pristine_.size(); n += 13) {
    write_text(manifest_, pristine_.substr(0, n));
    EXPECT_EQ(open_code(), ErrorCode::kBadInput) << n;
  }
  fs::remove(manifest_);
  EXPECT_EQ(open_code(), ErrorCode::kBadInput);
  EXPECT_EQ(thrown_code([&] { MapReader::open(temporary_ / "nothing"); }), ErrorCode::kBadInput);
}

TEST_F(DamagedMap, ChangedManifestsFailVerification) {
  std::string text = pristine_;
  text.replace(text.find("made.las"), 8, "fake.las");
  write_text(manifest_, text);
  EXPECT_EQ(open_code(), ErrorCode::kVerification);
}

TEST_F(DamagedMap, ForgedManifestsAreBadInput) {
  const std::pair<const char*, const char*> kForgeries[] = {
      {"\"format\":\"btms-map\"", "\"format\":\"other\""},
      {"\"schema_version\":2", "\"schema_version\":1"},
      {"\"schema_version\":2", "\"schema_version\":3"},
      {"\"schema_version\":2", "\"schema_version\":1.5"},
      {"\"schema_version\":2", "\"schema_version\":\"2\""},
      {"\"revision\":", "\"revision\":-"},
      {"\"resolution_mm\":2000", "\"resolution_mm\":0"},
      {"\"resolution_mm\":2000", "\"resolution_mm\":2001"},
      {"\"resolution_mm\":2000", "\"resolution_mm\":1e300"},
      {"\"tile_edge_cells\":128", "\"tile_edge_cells\":0"},
      {"\"tile_edge_cells\":128", "\"tile_edge_cells\":99999999999999999999"},
      {"\"origin\":[0,0]", "\"origin\":[0]"},
      {"\"origin\":[0,0]", "\"origin\":[64,0]"},
      {"\"inputs\":[", "\"inputs\":[[],"},
      {"\"inputs\":[", "\"trajectory\":[],\"inputs\":["},
      {"\"inputs\":[", "\"trajectory\":{\"name\":\"a\",\"poses\":-1,\"bytes\":1},\"inputs\":["},
      {"\"file\":\"x0_y0", "\"file\":\"../x0_y0"},
      {"\"file\":\"x0_y0", "\"file\":\"/etc/x0_y0"},
      {"\"file\":\"x0_y0", "\"file\":\".x0_y0"},
      {"\"id\":[0,0]", "\"id\":[0,1]"},
      {"\"tiles\":[[0,0,0,0,40,30]]", "\"tiles\":[]"},
      {"\"tiles\":[[0,0,0,0,40,30]]", "\"tiles\":[[0,0,0,0,40]]"},
      {"\"tiles\":[[0,0,0,0,40,30]]", "\"tiles\":[[0,0,40,30,0,0]]"},
      {"\"tiles\":[[0,0,0,0,40,30]]", "\"tiles\":[[0,0,0,0,400000000,400000000]]"},
      {"\"tiles\":[[0,0,0,0,40,30]]", "\"tiles\":[[1073741824,0,0,0,40,30]]"},
      {"30],\"bytes\":", "30],\"bytes\":1152921504606846976,\"b\":"},
      {"\"shards\":[", "\"shards\":[[[[[[[[[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]]]]]]]]],"},
      {"\"shards\":[", "\"shards\":[null,"},
      {"\"shards\":[", "\"chards\":["},
      {"\"keep_nodes\":\"", "\"keep_notes\":\""},
      {"\"keep_nodes\":\"", "\"keep_nodes\":\"-"},
  };
  for (const auto& [from, to] : kForgeries) {
    forge(from, to);
    EXPECT_EQ(open_code(), ErrorCode::kBadInput) << from << " -> " << to;
  }
}

TEST_F(DamagedMap, AMapOfAnOlderProgramIsToBeBuiltAgain) {
  forge("\"schema_version\":2", "\"schema_version\":1");
  try {
    MapReader::open(folder_);
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("build it again"), std::string::npos) << e.what();
  }
}

// With hashes that are right: the parser must not be slow, or fall over, on what its author wanted it to see.
TEST_F(DamagedMap, HostileManifestsAreRefusedFast) {
  std::string many = "\"shards\":[", wide = "\"shards\":[";
  for (int i = 0; i < 500'000; ++i) many += "{},", wide += "[[],[]],";
  const auto start = std::chrono::steady_clock::now();
  for (const std::string& hostile :
       {"\"shards\":[" + std::string(20'000'000, '['), "\"shards\":[" + std::string(20'000'000, '{'), many, wide}) {
    forge("\"shards\":[", hostile);
    EXPECT_EQ(open_code(), ErrorCode::kBadInput);
  }
  // Brackets in strings don't nest.
  forge("made.las", std::string(1000, '[') + "\\\"" + std::string(1000, '{'));
  EXPECT_EQ(MapReader::open(folder_)->tiles().size(), 1u);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST_F(DamagedMap, TheHashIsCheckedBeforeTheText) {
  std::string text = pristine_;
  text.insert(text.find("\"shards\":["), std::string(1000, '['));
  write_text(manifest_, text);
  EXPECT_EQ(open_code(), ErrorCode::kVerification);
}

// Shards changed at will, with every hash of the manifest made right again.
TEST_F(DamagedMap, ForgedShardsNeverCrashAReader) {
  const fs::path shard = files_in(folder_ / "shards").at(0);
  const std::string good = file_text(shard), name = "\"file_xxh3\":\"";
  const auto at = pristine_.find(name) + name.size();
  std::mt19937_64 random(11);
  int refused = 0;
  for (int i = 0; i < 60; ++i) {
    std::string bad = good;
    // Mostly where the metadata are: at the start.
    const std::size_t within = i % 2 == 0 ? std::min<std::size_t>(4096, bad.size()) : bad.size();
    for (std::uint64_t n = 1 + random() % 8; n > 0; --n) bad[random() % within] = static_cast<char>(random());
    write_text(shard, bad);
    std::string text = pristine_;
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(bad.data());
    text.replace(at, 16, hex64(xxh3_64({bytes, bad.size()})));
    rehash(text);
    write_text(manifest_, text);
    try {
      MapReader::open(folder_)->load({0, 0});
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kVerification) << e.what();
      ++refused;
    }
  }
  EXPECT_GT(refused, 20);
}

// Shape, hash of the file and sizes say one thing, the manifest's box another: nothing of the box's size is made.
TEST_F(DamagedMap, AShardThatIsSmallerThanItsBoxIsRefusedBeforeAllocating) {
  std::string text = pristine_;
  const auto replace = [&](const std::string& from, const std::string& to) {
    ASSERT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
  };
  replace("\"tile_edge_cells\":128", "\"tile_edge_cells\":16384");
  replace("[[0,0,0,0,40,30]]", "[[0,0,0,0,16384,16384]]");
  replace("\"bounds\":[0,0,40,30]", "\"bounds\":[0,0,16384,16384]");
  rehash(text);
  write_text(manifest_, text);
  const auto map = MapReader::open(folder_);
  const auto peak_kB = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
  };
  const auto before = peak_kB();
  EXPECT_EQ(thrown_code([&] { map->load({0, 0}); }), ErrorCode::kVerification);
  EXPECT_LT(peak_kB() - before, 1'000'000);  // the tile alone would take 10 GB
}

TEST_F(DamagedMap, AManifestThatLiesAboutAShardFailsVerification) {
  forge("[[0,0,0,0,40,30]]", "[[0,0,0,0,40,31]]");
  EXPECT_EQ(open_code(), ErrorCode::kBadInput);  // bounds
  std::string text = file_text(manifest_);
  text.replace(text.find("\"bounds\":[0,0,40,30]"), 20, "\"bounds\":[0,0,40,31]");
  rehash(text);
  write_text(manifest_, text);
  EXPECT_EQ(thrown_code([&] { MapReader::open(folder_)->load({0, 0}); }), ErrorCode::kVerification);
}

TEST_F(DamagedMap, RandomDamageToTheManifestNeverCrashes) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 600; ++i) {
    std::string text = pristine_;
    for (std::uint64_t n = 1 + random() % 4; n > 0; --n)
      text[25 + random() % (text.size() - 25)] = static_cast<char>(random());
    if (random() % 2) rehash(text);
    write_text(manifest_, text);
    try {
      const auto map = MapReader::open(folder_);
      for (const TileId id : map->tiles()) map->load(id);
    } catch (const Error&) {
    }
  }
}

}  // namespace
}  // namespace btms
