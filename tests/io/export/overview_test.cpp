// Windows out of stored layers and the overviews of shards: bit for bit what the tiles say.
#include <gmock/gmock.h>

#include <cstring>
#include <ostream>

#include "io/export/raster.h"
#include "io/store/manifest.h"
#include "io/store/map_folder.h"
#include "io/store/shard_overview.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

// Counts what is loaded.
class Counting final : public TileSource {
 public:
  explicit Counting(const TileSource& map) : map_(map) {}
  const MapLayout& layout() const override { return map_.layout(); }
  std::vector<TileId> tiles() const override { return map_.tiles(); }
  std::shared_ptr<const TerrainTile> load(TileId id) const override {
    auto tile = map_.load(id);
    loads += tile != nullptr;
    return tile;
  }
  mutable int loads = 0;

 private:
  const TileSource& map_;
};

std::vector<const RasterLayer*> all_layers() {
  std::vector<const RasterLayer*> all;
  for (const RasterLayer& layer : raster_layers()) all.push_back(&layer);
  return all;
}

bool same_bits(const Window& a, const Window& b) {
  return std::equal(a.values.begin(), a.values.end(), b.values.begin(), b.values.end(),
                    [](const auto& x, const auto& y) {
                      return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof x[0]) == 0;
                    });
}

struct Case {
  std::int32_t edge;
  CellBox cells;
  Cell origin;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.cells.cols() << " x " << c.cells.rows(); }
class OverviewOf : public testing::TestWithParam<Case> {
 protected:
  OverviewOf() {
    Tiles tiles = made_tiles(layout_, GetParam().cells, noisy_tile);
    // Gaps inside of shards, and shards that are missing.
    for (auto it = tiles.begin(); it != tiles.end();)
      it = noise(it->first.tx, it->first.ty, 3) % 4 == 0 ? tiles.erase(it) : std::next(it);
    write_map(folder_, layout_, tiles);
  }
  static CellBox around(const CellBox& cells, int level) {
    const CellBox inner = squares_sampled_in(cells, level);
    return {inner.col0 - 2, inner.row0 - 1, inner.col1 + 1, inner.row1 + 3};
  }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_ / "a.btms";
  const MapLayout layout_ = layout_of(2000, GetParam().edge, GetParam().origin);
};

TEST_P(OverviewOf, IsWhatTheTilesSay) {
  const auto map = MapReader::open(folder_);
  const auto layers = all_layers();
  int known = 0;
  for (int level = 0; level <= 10; ++level) {
    const Counting tiles(*map);
    const CellBox box = around(GetParam().cells, level);
    const Window expected = cut_window(*map, level, box, layers), found = cut_window(*map, tiles, level, box, layers);
    EXPECT_TRUE(same_bits(expected, found)) << level;
    EXPECT_EQ(found.cell_m, expected.cell_m);
    EXPECT_EQ(found.min_x_m, expected.min_x_m);
    const bool in_one_piece = GetParam().edge == 64;
    EXPECT_EQ(tiles.loads > 0, level < 3 && !expected.empty() && !(level == 0 && in_one_piece)) << level;
    known += level >= 3 && !found.empty();
    const std::vector<const RasterLayer*> one = {layers[7], layers[0]};
    EXPECT_TRUE(same_bits(cut_window(*map, level, box, one), cut_window(*map, tiles, level, box, one))) << level;
  }
  EXPECT_GE(known, 2);
}

INSTANTIATE_TEST_SUITE_P(Shapes, OverviewOf,
                         testing::Values(Case{64, {-130, -70, 200, 150}, {}}, Case{9, {-70, -30, 141, 95}, {}},
                                         Case{400, {-30, 120003, 260, 120255}, {-33, 120000}}));

TEST(Overview, DamageIsAnErrorThatNamesFileAndTile) {
  const TemporaryFolder temporary;
  const fs::path folder = temporary / "a.btms";
  const MapLayout layout = layout_of(2000, 128);
  write_map(folder, layout, made_tiles(layout, {0, 0, 128, 128}, noisy_tile));
  const fs::path shard = files_in(folder / "shards").at(0);
  const std::string good = file_text(shard);
  const auto map = MapReader::open(folder);
  const auto view = [&] { return cut_window(*map, *map, 4, {0, 0, 8, 8}, all_layers()); };
  const Window expected = view();
  for (std::size_t back = 1; back < 3000; back += 41) {  // overview and end of the file
    std::string bad = good;
    bad[bad.size() - back] = static_cast<char>(bad[bad.size() - back] ^ 4);
    write_text(shard, bad);
    try {
      view();
      ADD_FAILURE() << back;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kVerification);
      EXPECT_THAT(e.what(), testing::HasSubstr("tile 0,0 is damaged"));
      EXPECT_THAT(e.what(), testing::HasSubstr(shard.filename().string()));
    }
  }
  for (const std::string& bad : {good + "x", good.substr(1), std::string()}) {
    write_text(shard, bad);
    EXPECT_EQ(thrown_code(view), ErrorCode::kVerification);
  }
  fs::remove(shard);
  EXPECT_EQ(thrown_code(view), ErrorCode::kVerification);
  write_text(shard, good);
  EXPECT_TRUE(same_bits(view(), expected));
}

// A sound file of other values under the name of this one.
TEST(Overview, OfAnotherShardIsRefused) {
  const TemporaryFolder temporary;
  const MapLayout layout = layout_of(2000, 128);
  write_map(temporary / "a.btms", layout, made_tiles(layout, {0, 0, 128, 128}, hilly_tile));
  const auto map = MapReader::open(temporary / "a.btms");
  ShardEntry other = map->shards()[0];
  EXPECT_TRUE(map->overview(other).has_value());
  other.values_xxh3 ^= 1;
  EXPECT_EQ(thrown_code([&] { map->overview(other); }), ErrorCode::kVerification);
  // Of strangers nothing is parsed here.
  EXPECT_FALSE(MapReader::open(temporary / "a.btms", Trust::kUntrusted)->overview(map->shards()[0]));
}

}  // namespace
}  // namespace btms
