// Round trips, revisions and ranks of the map on disk.
#include "io/store/map_store.h"

#include <sys/resource.h>

#include <csignal>
#include <ostream>
#include <thread>

#include "tests/io/store/made_map.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

struct Shape {
  MapLayout layout;
  CellBox cells;
};
void PrintTo(const Shape& shape, std::ostream* out) { *out << shape.cells.cols() << " x " << shape.cells.rows(); }

class MapStoreShapes : public testing::TestWithParam<Shape> {};

TEST_P(MapStoreShapes, ReadsBackBitExactly) {
  const auto& [layout, cells] = GetParam();
  const TemporaryFolder temporary;
  const Tiles tiles = made_tiles(layout, cells, noisy_tile);
  write_map(temporary / "a.btms", layout, tiles);

  const auto map = MapReader::open(temporary / "a.btms");
  EXPECT_EQ(map->layout(), layout);
  std::vector<TileId> ids;
  Digest sum;
  for (const auto& [id, tile] : tiles) {
    ids.push_back(id);
    sum += digest(tile);
    const auto loaded = map->load(id);
    ASSERT_NE(loaded, nullptr);
    EXPECT_EQ(loaded->resolution_mm, tile.resolution_mm);
    EXPECT_EQ(loaded->box, tile.box);
    EXPECT_EQ(loaded->corner_mm, tile.corner_mm);
    EXPECT_EQ(loaded->centre_mm, tile.centre_mm);
    EXPECT_EQ(loaded->nodes, tile.nodes);
    EXPECT_EQ(loaded->upper, tile.upper);
    const auto for_labels = map->load_for_labels(id);
    ASSERT_NE(for_labels, nullptr);
    EXPECT_EQ(for_labels->box, tile.box);
    EXPECT_EQ(for_labels->corner_mm, tile.corner_mm);
    EXPECT_EQ(for_labels->centre_mm, tile.centre_mm);
    EXPECT_TRUE(std::equal(
        for_labels->nodes.begin(), for_labels->nodes.end(), tile.nodes.begin(), tile.nodes.end(),
        [](const NodeSurface& a, const NodeSurface& b) { return a.state == b.state && a.terrain_mm == b.terrain_mm; }));
  }
  EXPECT_EQ(map->tiles(), ids);
  EXPECT_EQ(map->info().digest, sum);
  EXPECT_EQ(map->load({1000, 1000}), nullptr);
  EXPECT_EQ(map->load_for_labels({1000, 1000}), nullptr);
}

INSTANTIATE_TEST_SUITE_P(Shapes, MapStoreShapes,
                         testing::Values(Shape{layout_of(2000, 1), {-9, -5, 8, 12}},
                                         Shape{layout_of(500, 8), {-70, -30, 41, 95}},
                                         Shape{layout_of(4000, 37), {-80, -80, 100, 60}},
                                         Shape{layout_of(2000, 128), {-200, -3, 131, 140}},
                                         Shape{layout_of(100, 128), {5, 7, 6, 8}},
                                         Shape{layout_of(2000, 400, {-33, 120000}), {-30, 120003, 260, 120255}}));

TEST(MapStore, KeepsWhatItSaysOfItself) {
  const TemporaryFolder temporary;
  const MapLayout layout = layout_of(2000, 128);
  MapInfo info;
  info.preset = "city";
  info.parameters.resolution_m = 2;
  info.parameters.node_model = NodeModel::kPca;
  info.crs_wkt = "EPSG:25832";
  info.inputs = {{"a\"b\n.las", 12, 345}, {"bytes \xff that are not UTF-8", 1, 2}};
  info.points = 13;
  info.dropped = 1;
  const auto writer = MapWriter::create(temporary / "a.btms", layout, {.crs = "EPSG:25832"});
  writer->put({0, 0}, noisy_tile(layout, {1, 1, 3, 3}));
  writer->put({1, 0}, TerrainTile(2000, CellBox{}));
  writer->publish(info, {writer->finish()});

  const auto map = MapReader::open(temporary / "a.btms");
  EXPECT_EQ(map->tiles(), std::vector<TileId>{TileId{}});
  EXPECT_EQ(map->info().preset, "city");
  EXPECT_EQ(map->info().parameters, info.parameters);
  EXPECT_TRUE(map->info().crs_wkt.starts_with("PROJCRS[")) << map->info().crs_wkt;
  EXPECT_EQ(map->info().inputs.at(0).name, info.inputs[0].name);
  EXPECT_EQ(map->info().inputs.at(0).bytes, 345u);
  EXPECT_EQ(map->info().points, 13u);
  EXPECT_EQ(map->info().dropped, 1u);
}

TEST(MapStore, AnEmptyMapIsAMap) {
  const TemporaryFolder temporary;
  write_map(temporary / "a.btms", layout_of(2000, 128), {});
  EXPECT_TRUE(MapReader::open(temporary / "a.btms")->tiles().empty());
}

TEST(MapStore, EqualTilesGiveEqualBytes) {
  const TemporaryFolder temporary;
  const MapLayout layout = layout_of(2000, 37);
  const Tiles tiles = made_tiles(layout, {-40, -40, 60, 40}, noisy_tile);
  write_map(temporary / "a.btms", layout, tiles);
  write_map(temporary / "b.btms", layout, tiles);
  for (const char* part : {"a.btms/manifest.json", "a.btms/map.nc", "a.btms/shards/x0_y0.r1.nc"}) {
    std::string other = part;
    other[0] = 'b';
    EXPECT_EQ(file_text(temporary / part), file_text(temporary / other.c_str())) << part;
  }
}

TEST(MapStore, ASecondBuildReplacesTheFirst) {
  const TemporaryFolder temporary;
  const fs::path folder = temporary / "a.btms";
  const MapLayout layout = layout_of(2000, 128);
  const Tiles first = made_tiles(layout, {0, 0, 300, 100}, noisy_tile);
  const Tiles second = made_tiles(layout, {10, 10, 90, 90}, hilly_tile);
  write_map(folder, layout, first);

  auto writer = MapWriter::create(folder, layout);
  for (const auto& [id, tile] : second) writer->put(id, TerrainTile(tile));
  const auto entries = writer->finish();
  const auto old = MapReader::open(folder), slow = MapReader::open(folder);
  EXPECT_EQ(old->info().revision, 1u);
  EXPECT_EQ(digest(*old->load({0, 0})), digest(first.at({0, 0})));
  writer->publish({}, {entries});
  writer.reset();

  const auto map = MapReader::open(folder);
  EXPECT_EQ(map->info().revision, 2u);
  EXPECT_EQ(map->tiles().size(), 1u);
  EXPECT_EQ(digest(*map->load({0, 0})), digest(second.at({0, 0})));
  EXPECT_EQ(files_in(folder / "shards").size(), 1 + first.size());
  EXPECT_EQ(files_in(folder).size(), 3u);
  // Who has the old revision open can finish; outrun by another one no more.
  for (const auto& [id, tile] : first) EXPECT_EQ(digest(*old->load(id)), digest(tile));
  write_map(folder, layout, second);
  EXPECT_EQ(files_in(folder / "shards").size(), 1u);  // what is as it was isn't written again
  EXPECT_EQ(thrown_code([&] { slow->load({0, 0}); }), ErrorCode::kVerification);
}

TEST(MapStore, AnAbandonedWriterLeavesTheOldMap) {
  const TemporaryFolder temporary;
  const fs::path folder = temporary / "a.btms";
  const MapLayout layout = layout_of(2000, 128);
  write_map(folder, layout, made_tiles(layout, {0, 0, 300, 100}, noisy_tile));
  const auto before = files_in(folder / "shards");
  {
    const auto writer = MapWriter::create(folder, layout);
    writer->put({0, 0}, noisy_tile(layout, {1, 1, 50, 50}));
    writer->finish();
    EXPECT_EQ(files_in(folder / "shards").size(), before.size() + 1);
  }
  EXPECT_EQ(files_in(folder / "shards").size(), before.size() + 1);  // committed, for one that takes it up
  EXPECT_EQ(MapReader::open(folder)->info().revision, 1u);
  {
    const auto writer = MapWriter::create(folder, layout, {.resume = true});
    writer->put({0, 0}, noisy_tile(layout, {1, 1, 50, 50}));
    writer->finish();
  }
  EXPECT_EQ(files_in(folder / "shards").size(), before.size() + 1);
  { const auto afresh = MapWriter::create(folder, layout); }
  EXPECT_EQ(files_in(folder / "shards"), before);
  {
    const auto writer = MapWriter::create(temporary / "new.btms", layout);
    writer->put({0, 0}, noisy_tile(layout, {1, 1, 50, 50}));
  }
  EXPECT_FALSE(fs::exists(temporary / "new.btms"));
}

TEST(MapStore, RestsOfAKilledWriterAreRemoved) {
  const TemporaryFolder temporary;
  const fs::path folder = temporary / "a.btms";
  const MapLayout layout = layout_of(2000, 128);
  fs::create_directories(folder / "shards");
  write_text(folder / "shards" / ".btms-1-0.tmp", "torn");
  write_text(folder / "shards" / "x5_y5.r1.nc", "never published");
  write_map(folder, layout, made_tiles(layout, {0, 0, 10, 10}, noisy_tile));
  EXPECT_EQ(files_in(folder / "shards").size(), 1u);
}

TEST(MapStore, AFailedWriteLeavesTheOldMapAndNoFiles) {
  const TemporaryFolder temporary;
  const fs::path folder = temporary / "a.btms";
  const MapLayout layout = layout_of(2000, 128);
  write_map(folder, layout, made_tiles(layout, {0, 0, 100, 100}, noisy_tile));
  {
    const auto writer = MapWriter::create(folder, layout);
    // Files longer than this can't be written: to the writer it looks like a full disk.
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit tight{4096, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &tight);
    const ErrorCode code = thrown_code([&] { writer->put({0, 0}, noisy_tile(layout, {1, 1, 90, 90})); });
    setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, handler);
    EXPECT_EQ(code, ErrorCode::kFailed);
    EXPECT_EQ(thrown_code([&] { writer->finish(); }), ErrorCode::kFailed);
  }
  EXPECT_EQ(files_in(folder / "shards").size(), 1u);
  EXPECT_EQ(files_in(folder).size(), 3u);
  EXPECT_EQ(MapReader::open(folder)->load({0, 0})->box, (CellBox{0, 0, 100, 100}));
}

TEST(MapStore, OnlyMapsAreReplaced) {
  const TemporaryFolder temporary;
  fs::create_directories(temporary / "home");
  write_text(temporary / "home/thesis.txt", "x");
  write_text(temporary / "file", "x");
  const auto create = [&](const char* name) { MapWriter::create(temporary / name, layout_of(2000, 128)); };
  EXPECT_EQ(thrown_code([&] { create("home"); }), ErrorCode::kUsage);
  EXPECT_EQ(thrown_code([&] { create("file"); }), ErrorCode::kUsage);
  EXPECT_EQ(file_text(temporary / "home/thesis.txt"), "x");
  write_text(temporary / "home/manifest.json", "{}");
  EXPECT_EQ(thrown_code([&] { create("home"); }), ErrorCode::kUsage);
}

TEST(MapStore, RanksWriteOneMap) {
  const TemporaryFolder temporary;
  const fs::path folder = temporary / "a.btms";
  const MapLayout layout = layout_of(2000, 128);
  const Tiles tiles = made_tiles(layout, {-200, -200, 200, 200}, noisy_tile);
  std::vector<std::vector<std::uint8_t>> entries(3);
  const auto zero = MapWriter::create(folder, layout);
  for (int rank = 2; rank >= 0; --rank) {
    std::unique_ptr<MapWriter> own;
    if (rank != 0) own = MapWriter::create(folder, layout, {.rank = rank});
    MapWriter& writer = rank == 0 ? *zero : *own;
    int i = 0;
    for (const auto& [id, tile] : tiles)
      if (i++ % 3 == rank) writer.put(id, TerrainTile(tile));
    entries[static_cast<std::size_t>(rank)] = writer.finish();
  }
  zero->publish({}, entries);
  const auto map = MapReader::open(folder);
  EXPECT_EQ(map->tiles().size(), tiles.size());
  for (const auto& [id, tile] : tiles) EXPECT_EQ(digest(*map->load(id)), digest(tile));
}

TEST(MapStore, ThreadsShareAWriterAndAReader) {
  const TemporaryFolder temporary;
  const MapLayout layout = layout_of(2000, 16);
  const Tiles tiles = made_tiles(layout, {-130, -130, 130, 130}, noisy_tile);
  const std::vector<std::pair<TileId, TerrainTile>> list(tiles.begin(), tiles.end());
  const auto in_threads = [&](auto&& work) {
    std::vector<std::jthread> threads;
    for (std::size_t k = 0; k < 4; ++k)
      threads.emplace_back([&, k] {
        for (std::size_t i = k; i < list.size(); i += 4) work(list[i]);
      });
  };
  const auto writer = MapWriter::create(temporary / "a.btms", layout);
  in_threads([&](const auto& t) { writer->put(t.first, TerrainTile(t.second)); });
  writer->publish({}, {writer->finish()});
  const auto map = MapReader::open(temporary / "a.btms");
  in_threads([&](const auto& t) { EXPECT_EQ(map->load(t.first)->nodes, t.second.nodes); });
}

TEST(MapStore, RefusesWhatIsNotSeamlessOrComesTwice) {
  const TemporaryFolder temporary;
  const MapLayout layout = layout_of(2000, 8);
  const auto writer = MapWriter::create(temporary / "a.btms", layout);
  writer->put({0, 0}, noisy_tile(layout, layout.grid.box_of({0, 0})));
  EXPECT_EQ(thrown_code([&] { writer->put({0, 0}, TerrainTile(2000, {0, 0, 1, 1})); }), ErrorCode::kFailed);
  EXPECT_EQ(thrown_code([&] { writer->put({3, 3}, TerrainTile(2000, {0, 0, 1, 1})); }), ErrorCode::kFailed);
  EXPECT_EQ(thrown_code([&] { writer->finish(); }), ErrorCode::kFailed);

  const auto torn = MapWriter::create(temporary / "b.btms", layout);
  torn->put({0, 0}, noisy_tile(layout, layout.grid.box_of({0, 0})));
  TerrainTile neighbour = noisy_tile(layout, layout.grid.box_of({1, 0}));
  neighbour.corner_mm[0] += 1;
  torn->put({1, 0}, std::move(neighbour));
  EXPECT_EQ(thrown_code([&] { torn->finish(); }), ErrorCode::kFailed);
}

}  // namespace
}  // namespace btms
