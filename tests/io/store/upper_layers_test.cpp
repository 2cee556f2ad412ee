// Further surfaces as lists: there and back, and lists nobody could have written.
#include "io/store/upper_layers.h"

#include "io/store/hdf5.h"
#include "io/store/shard_file.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

const MapLayout kLayout = layout_of(2000, 128);

TEST(UpperLayers, ListedInTheOrderOfTheRastersAndBack) {
  const TerrainTile tile = noisy_tile(kLayout, {-3, 5, 30, 17});
  ASSERT_GT(tile.upper.size(), 100u);
  std::vector<ListedUpper> listed = list_upper(tile);
  EXPECT_TRUE(is_sound_list(listed, tile.box));
  // The first of the list lies below: triangle, row from the north, column.
  const std::uint32_t t = listed[0].node / (12 * 33), line = listed[0].node / 33 % 12, col = listed[0].node % 33;
  const NodeId id{{-3 + static_cast<std::int32_t>(col), 16 - static_cast<std::int32_t>(line)},
                  static_cast<std::uint8_t>(t)};
  EXPECT_EQ(std::count_if(tile.upper.begin(), tile.upper.end(),
                          [&](const UpperNode& u) { return u.node == tile.node_index(id); }),
            std::count_if(listed.begin(), listed.end(), [&](const auto& u) { return u.node == listed[0].node; }));
  EXPECT_EQ(unlist_upper(std::move(listed), tile.box), tile.upper);
}

TEST(UpperLayers, HostileListsAreRefused) {
  const TerrainTile tile = noisy_tile(kLayout, {0, 0, 10, 10});
  const std::vector<ListedUpper> good = list_upper(tile);
  const auto refused = [&](auto change) {
    std::vector<ListedUpper> bad = good;
    change(bad);
    return thrown_code([&] { unlist_upper(std::move(bad), tile.box); }) == ErrorCode::kVerification;
  };
  EXPECT_TRUE(refused([](auto& l) { l.back().node = 400; }));
  EXPECT_TRUE(refused([](auto& l) { l.back().node = 0xFFFFFFFF; }));
  EXPECT_TRUE(refused([](auto& l) { std::swap(l.front(), l.back()); }));
  EXPECT_TRUE(refused([](auto& l) { l[0] = l[1], l[0].z_mm = l[1].z_mm + 1, l[0].node = l[1].node; }));
  EXPECT_TRUE(refused([](auto& l) { l[3].kind = UpperKind{0}; }));
  EXPECT_TRUE(refused([](auto& l) { l[3].kind = UpperKind{3}; }));
}

TEST(UpperLayers, AWriterRefusesATileWhoseListIsOutOfOrder) {
  const TemporaryFolder temporary;
  TerrainTile tile = noisy_tile(kLayout, {0, 0, 10, 10});
  std::swap(tile.upper.front(), tile.upper.back());
  const auto writer = MapWriter::create(temporary / "a.btms", kLayout);
  EXPECT_EQ(thrown_code([&] { writer->put({0, 0}, std::move(tile)); }), ErrorCode::kFailed);
}

// More entries than a chunk holds.
TEST(UpperLayers, LongListsReadBack) {
  TerrainTile tile(2000, {0, 0, 100, 100});
  for (std::uint32_t i = 0; i < 150'000; ++i)
    tile.upper.push_back(
        {i / 4, static_cast<std::int32_t>(i % 4 * 3000), static_cast<std::int16_t>(i), 7, 9, 11, UpperKind::kDetached});
  const EncodedShard shard = encode_shard(tile, {});
  EXPECT_EQ(decode_shard({shard.file, 2000, tile.box}, shard.values_xxh3).upper, tile.upper);
}

// A list that nobody has written takes a few bytes of a file, however long.
class ForgedList : public testing::Test {
 protected:
  // What is wrong with the shard when lists are replaced by unwritten ones of this length; empty when nothing is.
  std::string refusal(const std::vector<std::string>& lists, hsize_t extent) {
    const std::string path = temporary_ / "a.nc";
    write_text(path, {shard_.file.begin(), shard_.file.end()});
    const QuietHdf5 quiet;
    Hdf5File file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), "open");
    Hdf5Group tgf(H5Gopen2(file.get(), "tgf", H5P_DEFAULT), "open");
    for (const std::string& list : lists) {
      Hdf5Dataset old(H5Dopen2(tgf.get(), list.c_str(), H5P_DEFAULT), "open");
      const Hdf5Type type(H5Dget_type(old.get()), "type");
      old.close();
      hdf5_check(H5Ldelete(tgf.get(), list.c_str(), H5P_DEFAULT), "delete");
      const hsize_t chunk = std::min<hsize_t>(extent, 65536);
      const Hdf5Space space(H5Screate_simple(1, &extent, nullptr), "create");
      const Hdf5Properties p(H5Pcreate(H5P_DATASET_CREATE), "create");
      hdf5_check(H5Pset_chunk(p.get(), 1, &chunk), "chunk");
      Hdf5Dataset data(H5Dcreate2(tgf.get(), list.c_str(), type.get(), space.get(), H5P_DEFAULT, p.get(), H5P_DEFAULT),
                       "create");
      data.close();
    }
    tgf.close();
    file.close();
    const std::string text = file_text(path);
    try {
      decode_shard({{reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, 2000, box_}, shard_.values_xxh3);
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kVerification);
      return e.what();
    }
    return {};
  }

  static std::vector<std::string> all() {
    std::vector<std::string> names;
    for (const LayerInfo& layer : layer_table())
      if (layer.raster == Raster::kPerUpper) names.emplace_back(layer.name);
    return names;
  }

  const CellBox box_{0, 0, 10, 10};
  const std::size_t most_ = 400 * kMaxUpperPerNode;
  const EncodedShard shard_ = encode_shard(noisy_tile(kLayout, box_), {});
  const TemporaryFolder temporary_;
};

TEST_F(ForgedList, LongerThanTheBoxCanBear) {
  for (const hsize_t n : {hsize_t{most_ + 1}, hsize_t{1} << 36})
    EXPECT_NE(refusal(all(), n).find("impossible length"), std::string::npos) << n;
}

TEST_F(ForgedList, JustAsLongAsTheBoxCanBearButNotStored) {
  for (const hsize_t n : {hsize_t{kMaxUpperPerNode + 1}, hsize_t{most_}})
    EXPECT_NE(refusal(all(), n).find("longer than what is stored"), std::string::npos) << n;
}

TEST_F(ForgedList, OfAnotherLengthThanThePlaces) {
  for (const hsize_t n : {hsize_t{1}, hsize_t{most_}, hsize_t{1} << 36})
    EXPECT_NE(refusal({"upper_height"}, n).find("another shape"), std::string::npos) << n;
}

// As many as a node bears, at every node of a small tile, and nothing but place 0, which is not stored.
TEST(UpperLayers, FullListsReadBack) {
  for (const std::uint32_t nodes : {400u, 1u}) {
    TerrainTile tile(2000, {0, 0, 10, 10});
    for (std::uint32_t i = 0; i < nodes * kMaxUpperPerNode; ++i)
      tile.upper.push_back({static_cast<std::uint32_t>(i / kMaxUpperPerNode),
                            static_cast<std::int32_t>(i % kMaxUpperPerNode * 3000), 0, 0, 0, 3, UpperKind::kDetached});
    EXPECT_TRUE(is_sound_list(tile.upper, tile.box));
    const EncodedShard shard = encode_shard(tile, {});
    EXPECT_EQ(decode_shard({shard.file, 2000, tile.box}, shard.values_xxh3).upper, tile.upper);
  }
}

TEST(UpperLayers, MoreThanANodeBearsAreRefused) {
  const TemporaryFolder temporary;
  TerrainTile tile(2000, {0, 0, 10, 10});
  for (std::uint32_t i = 0; i <= kMaxUpperPerNode; ++i)
    tile.upper.push_back({7, static_cast<std::int32_t>(i * 3000), 0, 0, 0, 3, UpperKind::kDetached});
  const EncodedShard shard = encode_shard(tile, {});
  EXPECT_EQ(thrown_code([&] {
              decode_shard({shard.file, 2000, tile.box}, shard.values_xxh3);
            }),
            ErrorCode::kVerification);
  const auto writer = MapWriter::create(temporary / "a.btms", kLayout);
  EXPECT_EQ(thrown_code([&] { writer->put({0, 0}, std::move(tile)); }), ErrorCode::kFailed);
}

TEST(UpperLayers, AShardWithoutAnyHasNoLists) {
  const TerrainTile tile = hilly_tile(kLayout, {0, 0, 10, 10});
  const EncodedShard shard = encode_shard(tile, {});
  const std::string text(shard.file.begin(), shard.file.end());
  EXPECT_EQ(text.find("upper_height"), std::string::npos);
  EXPECT_TRUE(decode_shard({shard.file, 2000, tile.box}, shard.values_xxh3).upper.empty());
}

}  // namespace
}  // namespace btms
