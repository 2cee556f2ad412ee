// Several builds in one folder, builds that end badly, and files that are not ours.
#include "io/store/map_folder.h"
#include "io/store/journal.h"

#include <sys/wait.h>

#include <csignal>

#include "io/store/hash.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

class MapFolder : public testing::Test {
 protected:
  void write_some_map() { write_map(folder_, layout_, made_tiles(layout_, {0, 0, 300, 100}, noisy_tile)); }
  std::unique_ptr<MapWriter> writer(int rank = 0) const { return MapWriter::create(folder_, layout_, {.rank = rank}); }
  TerrainTile tile(TileId id) const { return noisy_tile(layout_, layout_.grid.box_of(id)); }

  const TemporaryFolder temporary_;
  const MapLayout layout_ = layout_of(2000, 128);
  const fs::path folder_ = temporary_ / "a.btms";
};

TEST_F(MapFolder, OnlyOneBuildWritesAndReadersDoNotWait) {
  write_some_map();
  auto first = writer();
  first->put({0, 0}, tile({0, 0}));
  try {
    writer();
    FAIL() << "a second build was let in";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFailed);
    EXPECT_NE(std::string(e.what()).find("another build is writing here"), std::string::npos) << e.what();
  }
  EXPECT_NE(MapReader::open(folder_)->load({0, 0}), nullptr);
  first->publish({}, {first->finish()});
  EXPECT_EQ(thrown_code([&] { writer(); }), ErrorCode::kFailed);
  first.reset();
  EXPECT_EQ(MapReader::open(folder_)->tiles().size(), 1u);
  writer();
}

TEST_F(MapFolder, ARefusedBuildWithRanksLeavesTheOtherAlone) {
  const auto first = writer();
  const auto other_rank = writer(1);
  EXPECT_EQ(thrown_code([&] { writer(); }), ErrorCode::kFailed);
  writer(1);  // of the refused build; ends with it
  first->put({0, 0}, tile({0, 0}));
  other_rank->put({1, 0}, tile({1, 0}));
  const auto entries = other_rank->finish();
  first->publish({}, {first->finish(), entries});
  EXPECT_EQ(MapReader::open(folder_)->tiles().size(), 2u);
  EXPECT_NE(MapReader::open(folder_)->load({1, 0}), nullptr);
}

TEST_F(MapFolder, AFailedBuildWithRanksLeavesWhatItHasCommitted) {
  write_some_map();
  const auto before = files_in(folder_ / "shards");
  for (const bool zero_ends_first : {true, false}) {
    auto zero = writer(), one = writer(1);
    zero->put({0, 0}, tile({0, 0}));
    one->put({1, 0}, tile({1, 0}));
    zero->finish();
    one->finish();
    EXPECT_EQ(files_in(folder_ / "shards").size(), before.size() + 2);
    if (zero_ends_first) zero.reset();
    one.reset();
    zero.reset();
    EXPECT_EQ(files_in(folder_ / "shards").size(), before.size() + 2);
    const auto interrupted = read_journals(folder_);
    ASSERT_TRUE(interrupted);
    EXPECT_EQ(journaled_shards(*interrupted, layout_).size(), 2u);
    writer();  // begins afresh
    EXPECT_EQ(files_in(folder_ / "shards"), before);
  }
  // What a rank finishes after rank 0 has given up.
  auto zero = writer(), one = writer(1);
  one->put({1, 0}, tile({1, 0}));
  zero.reset();
  one->put({2, 0}, tile({2, 0}));
  one->finish();
  one.reset();
  EXPECT_EQ(files_in(folder_ / "shards").size(), before.size() + 2);
  writer();
  EXPECT_EQ(files_in(folder_ / "shards"), before);
  EXPECT_EQ(MapReader::open(folder_)->info().revision, 1u);
}

TEST_F(MapFolder, AKilledWriterHindersNobody) {
  const pid_t child = ::fork();
  if (child == 0) {
    const auto killed = writer(), other_rank = writer(1);
    killed->put({0, 0}, tile({0, 0}));
    other_rank->put({5, 0}, tile({5, 0}));
    other_rank->finish();
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_GE(files_in(folder_ / "shards").size(), 1u);
  write_some_map();
  const auto map = MapReader::open(folder_);
  for (const TileId id : map->tiles()) EXPECT_NE(map->load(id), nullptr);
  EXPECT_EQ(files_in(folder_ / "shards").size(), map->tiles().size());
  EXPECT_EQ(files_in(folder_).size(), 3u);
}

TEST_F(MapFolder, KnowsItsOwnNamesExactly) {
  EXPECT_EQ(shard_revision(shard_file_name({-3, 17}, 12)), 12u);
  EXPECT_EQ(shard_revision("x3_y-1.r2.nc"), 2u);
  for (const char* name : {"x.nc", "xray.nc", "x1_y2.nc", "x1_y2.r.nc", "x1_y2.r3.nc4", "x1_y2.r3.ncx", "x01_y2.r3.nc",
                           "x+1_y2.r3.nc", "x-0_y2.r3.nc", "X1_y2.r3.nc", "x1_y2.r-3.nc", "ax1_y2.r3.nc", "",
                           "x99999999999_y2.r3.nc", "x1_y2.r3.nc.aux.xml"})
    EXPECT_FALSE(shard_revision(name)) << name;
}

TEST_F(MapFolder, AMapOfAnOlderProgramIsNotReplaced) {
  write_some_map();
  std::string text = file_text(folder_ / "manifest.json");
  const std::string schema = "\"schema_version\":";
  text[text.find(schema) + schema.size()] = '1';
  const auto refusal = [&] {
    write_text(folder_ / "manifest.json", text);
    try {
      writer();
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kUsage);
      EXPECT_EQ(file_text(folder_ / "manifest.json"), text);
      return std::string(e.what());
    }
    return std::string("nothing");
  };
  EXPECT_NE(refusal().find("not a sound map"), std::string::npos) << refusal();  // its hash is wrong
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
  text.replace(9, 16, hex64(xxh3_64({bytes + 25, text.size() - 25})));
  EXPECT_NE(refusal().find("made by an older program; remove it first"), std::string::npos) << refusal();
}

TEST_F(MapFolder, UsersFilesStay) {
  fs::create_directories(folder_ / "shards");
  for (const char* name : {"shards/xray.nc", "shards/notes.txt", ".tmp-mine", "map.nc"}) {
    write_text(folder_ / name, "mine");
    EXPECT_EQ(thrown_code([&] { writer(); }), ErrorCode::kUsage) << name;
    EXPECT_EQ(file_text(folder_ / name), "mine");
    fs::remove(folder_ / name);
  }
  write_some_map();  // now it is a map, and what others add to it stays
  write_text(folder_ / "shards/xray.nc", "mine");
  write_text(folder_ / "shards/.tmp-mine", "mine");
  write_some_map();
  EXPECT_EQ(file_text(folder_ / "shards/xray.nc"), "mine");
  EXPECT_EQ(file_text(folder_ / "shards/.tmp-mine"), "mine");
}

TEST_F(MapFolder, AFailedCommitLeavesTheOldMapAndItsView) {
  write_some_map();
  const std::string view = file_text(folder_ / "map.nc"), manifest = file_text(folder_ / "manifest.json");
  {
    const auto failing = writer();
    failing->put({0, 0}, tile({0, 0}));
    const auto entries = failing->finish();
    fs::remove(folder_ / "manifest.json");
    fs::create_directories(folder_ / "manifest.json");  // a file can't replace it
    EXPECT_EQ(thrown_code([&] { failing->publish({}, {entries}); }), ErrorCode::kFailed);
    fs::remove(folder_ / "manifest.json");
    write_text(folder_ / "manifest.json", manifest);
  }
  EXPECT_EQ(file_text(folder_ / "map.nc"), view);
  EXPECT_EQ(files_in(folder_).size(), 4u);  // and the journal
  EXPECT_EQ(MapReader::open(folder_)->tiles().size(), 3u);
  EXPECT_NE(MapReader::open(folder_)->load({0, 0}), nullptr);
}

}  // namespace
}  // namespace btms
