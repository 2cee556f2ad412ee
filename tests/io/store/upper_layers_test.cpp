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
  EXPECT_EQ(decode_shard(shard.file, 2000, tile.box, shard.values_xxh3).upper, tile.upper);
}

// A list of 2^36 entries that nobody has written takes a few bytes of a file.
TEST(UpperLayers, AListLongerThanItsFileCanHoldIsRefusedBeforeAllocating) {
  const TemporaryFolder temporary;
  const EncodedShard shard = encode_shard(noisy_tile(kLayout, {0, 0, 10, 10}), {});
  write_text(temporary / "a.nc", {shard.file.begin(), shard.file.end()});
  for (const char* list : {"upper", "upper_height"}) {
    const QuietHdf5 quiet;
    Hdf5File file(H5Fopen((temporary / "a.nc").c_str(), H5F_ACC_RDWR, H5P_DEFAULT), "open");
    Hdf5Group tgf(H5Gopen2(file.get(), "tgf", H5P_DEFAULT), "open");
    hdf5_check(H5Ldelete(tgf.get(), list, H5P_DEFAULT), "delete");
    const hsize_t extent = hsize_t{1} << 36, chunk = 65536;
    const Hdf5Space space(H5Screate_simple(1, &extent, nullptr), "create");
    const Hdf5Properties p(H5Pcreate(H5P_DATASET_CREATE), "create");
    hdf5_check(H5Pset_chunk(p.get(), 1, &chunk), "chunk");
    Hdf5Dataset data(H5Dcreate2(tgf.get(), list, H5T_STD_I32LE, space.get(), H5P_DEFAULT, p.get(), H5P_DEFAULT),
                     "create");
    data.close();
    tgf.close();
    file.close();
    const std::string text = file_text(temporary / "a.nc");
    const std::vector<std::uint8_t> bytes(text.begin(), text.end());
    try {
      decode_shard(bytes, 2000, {0, 0, 10, 10}, shard.values_xxh3);
      ADD_FAILURE() << list;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kVerification);
      EXPECT_NE(std::string(e.what()).find("impossible length"), std::string::npos) << e.what();
    }
  }
}

TEST(UpperLayers, AShardWithoutAnyHasNoLists) {
  const TerrainTile tile = hilly_tile(kLayout, {0, 0, 10, 10});
  const EncodedShard shard = encode_shard(tile, {});
  const std::string text(shard.file.begin(), shard.file.end());
  EXPECT_EQ(text.find("upper_height"), std::string::npos);
  EXPECT_TRUE(decode_shard(shard.file, 2000, tile.box, shard.values_xxh3).upper.empty());
}

}  // namespace
}  // namespace btms
