#include <thread>

#include "tests/io/points/malformed_las.h"

namespace btms::test {
namespace {

class EveryFormat : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(LasReader, EveryFormat, ::testing::Range(0, 11));

TEST_P(EveryFormat, GivesCoordinatesAndClasses) {
  const auto format = static_cast<std::uint8_t>(GetParam());
  for (std::uint8_t minor = 0; minor <= 4; ++minor) {
    if (format >= 6 && minor < 4) continue;
    for (const auto extra : std::initializer_list<std::uint16_t>{0, 7, 60'000}) {
      SCOPED_TRACE("LAS 1." + std::to_string(minor) + ", extra bytes " + std::to_string(extra));
      const TemporaryFolder folder;
      LasSpec spec = las_spec(minor, format);
      spec.extra_bytes = extra;
      spec.vlrs = {{"someone", 7, Bytes(33, 1)}, {"someone", 8, {}}};
      const Bytes bytes = las_bytes(spec);
      const auto path = folder.write("a.las", bytes);
      const auto file = open_points(path);
      EXPECT_EQ(file->info().format, "LAS 1." + std::to_string(minor) + ", point format " + std::to_string(format));
      EXPECT_EQ(file->info().points, 3u);
      EXPECT_EQ(file->info().bytes, bytes.size());
      EXPECT_TRUE(file->info().warnings.empty()) << file->info().warnings.front();
      const PointBlock block = read_all(*file);
      EXPECT_EQ(block.x_mm, (std::vector<std::int64_t>{1000, -1500, 0}));
      EXPECT_EQ(block.y_mm, (std::vector<std::int64_t>{2000, 2500, 0}));
      EXPECT_EQ(block.z_mm, (std::vector<std::int32_t>{3000, -3500, 0}));
      EXPECT_EQ(block.dropped(), 0u);
      const auto classes = read_classes(path);
      ASSERT_EQ(classes.size(), 3u);
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_EQ(classes[i],
                  bytes[points_offset(spec) + i * record_bytes(spec) + class_offset(format)] & class_bits(format));
    }
  }
}

TEST(LasReader, RoundsToTheNearestMillimetreTiesToEven) {
  const TemporaryFolder folder;
  LasSpec spec;
  spec.scale = {0.0005, 0.00025, 0.0001};
  spec.xyz = {{1, 2, 4}, {3, 6, 6}, {5, 3, 5}, {-1, -6, -6}, {-3, -3, -15}};
  const PointBlock block = read_all(*open_points(folder.write("a.las", las_bytes(spec))));
  EXPECT_EQ(block.x_mm, (std::vector<std::int64_t>{0, 2, 2, 0, -2}));
  EXPECT_EQ(block.y_mm, (std::vector<std::int64_t>{0, 2, 1, -2, -1}));
  EXPECT_EQ(block.z_mm, (std::vector<std::int32_t>{0, 1, 0, -1, -2}));
}

// The path for whole millimetres against exact arithmetic, at both ends of the file's integers.
TEST(LasReader, IsExactForWholeMillimetres) {
  constexpr std::int32_t kLow = std::numeric_limits<std::int32_t>::min(),
                         kHigh = std::numeric_limits<std::int32_t>::max();
  for (const std::int64_t scale_mm : {1, 2, 10, 50, 100}) {
    for (const std::int64_t offset_m : {0, 4'500'000, -291'000}) {
      SCOPED_TRACE(std::to_string(scale_mm) + " mm, offset " + std::to_string(offset_m));
      const TemporaryFolder folder;
      LasSpec spec;
      spec.scale = {static_cast<double>(scale_mm) / 1000, static_cast<double>(scale_mm) / 1000, 0.001};
      spec.offset = {static_cast<double>(offset_m), 0, 0};
      spec.xyz.clear();
      for (int i = -1500; i < 1500; ++i) spec.xyz.push_back({i * 1'000'003, -i * 700'001, i * 80'000});
      spec.xyz.push_back({kLow, kHigh, 0});
      spec.xyz.push_back({kHigh, kLow, 0});
      const PointBlock block = read_all(*open_points(folder.write("a.las", las_bytes(spec))));
      std::size_t dropped = 0;
      for (std::size_t i = 0; i < spec.xyz.size(); ++i) {
        const std::int64_t x = spec.xyz[i][0] * scale_mm + offset_m * 1000, y = spec.xyz[i][1] * scale_mm;
        const bool inside = std::abs(x) <= kMaxHorizontal_mm && std::abs(y) <= kMaxHorizontal_mm;
        ASSERT_EQ(block.x_mm[i], inside ? x : PointBlock::kDroppedX) << i;
        dropped += inside ? 0 : 1;
        if (!inside) continue;
        ASSERT_EQ(block.y_mm[i], y) << i;
        ASSERT_EQ(block.z_mm[i], spec.xyz[i][2]) << i;
      }
      EXPECT_EQ(block.out_of_range, dropped);
    }
  }
}

TEST(LasReader, DropsHeightsOutOfRangeAndKeepsTheirPlace) {
  for (const int offset_m : {100, -100}) {
    SCOPED_TRACE(offset_m);
    const TemporaryFolder folder;
    LasSpec spec;
    spec.offset = {0, 0, static_cast<double>(offset_m)};
    const std::int32_t top = kMaxVertical_mm - 1000 * offset_m, bottom = -kMaxVertical_mm - 1000 * offset_m;
    // Alone, too: a run without any point that is dropped takes another path.
    const std::vector<std::int32_t> heights = {
        top, top + 1, bottom, bottom - 1, std::numeric_limits<std::int32_t>::max(), 0};
    spec.xyz.clear();
    for (std::size_t i = 0; i < heights.size(); ++i) spec.xyz.push_back({static_cast<std::int32_t>(i), 0, heights[i]});
    const auto file = open_points(folder.write("a.las", las_bytes(spec)));
    const PointBlock all = read_all(*file);
    EXPECT_EQ(all.out_of_range, 3u);
    EXPECT_EQ(all.not_finite, 0u);
    PointBlock one;
    for (std::size_t i = 0; i < heights.size(); ++i) {
      const bool dropped = i == 1 || i == 3 || i == 4;
      EXPECT_EQ(all.x_mm[i], dropped ? PointBlock::kDroppedX : static_cast<std::int64_t>(i)) << i;
      file->read(i, 1, one);
      EXPECT_EQ(one.x_mm[0], all.x_mm[i]) << i;
    }
  }
}

TEST(LasReader, ReadsAnyRunLikeTheWhole) {
  const TemporaryFolder folder;
  LasSpec spec = las_spec(4, 7);
  spec.xyz.clear();
  for (int i = 0; i < 40'000; ++i) spec.xyz.push_back({i, -i, 7 * i});
  const auto file = open_points(folder.write("a.las", las_bytes(spec)));
  const PointBlock whole = read_all(*file);
  PointBlock part;
  for (const auto& [first, count] : {std::pair{0, 1}, {39'999, 1}, {511, 1026}, {7'000, 33'000}, {40'000, 0}}) {
    file->read(static_cast<std::uint64_t>(first), static_cast<std::size_t>(count), part);
    ASSERT_EQ(part.size(), static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < part.size(); ++i)
      ASSERT_EQ(part.z_mm[i], whole.z_mm[static_cast<std::size_t>(first) + i]);
  }
}

TEST(LasReader, IsSafeToReadFromManyThreads) {
  const TemporaryFolder folder;
  LasSpec spec;
  spec.xyz.clear();
  for (int i = 0; i < 50'000; ++i) spec.xyz.push_back({i, 2 * i, 3 * i});
  const auto file = open_points(folder.write("a.las", las_bytes(spec)));
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      PointBlock block;
      for (std::uint64_t first = static_cast<std::uint64_t>(t); first + 999 < 50'000; first += 777) {
        file->read(first, 999, block);
        for (std::size_t i = 0; i < 999; ++i) wrong += block.x_mm[i] != static_cast<std::int64_t>(first + i) ? 1 : 0;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST(LasReader, NoticesThatTheFileChanged) {
  const TemporaryFolder folder;
  const Bytes bytes = las_bytes({});
  const auto path = folder.write("a.las", bytes);
  const auto file = open_points(path);
  PointBlock block;

  std::filesystem::resize_file(path, bytes.size() - 10);
  expect_error(ErrorCode::kBadInput, path, {"changed while read"}, [&] { file->read(0, 3, block); });
  std::filesystem::resize_file(path, bytes.size() + 10);
  expect_error(ErrorCode::kBadInput, path, {"changed while read"}, [&] { file->read(0, 3, block); });
  std::filesystem::remove(path);
  expect_error(ErrorCode::kBadInput, path, {"No such file"}, [&] { file->read(0, 3, block); });
}

TEST(LasReader, AcceptsOddFiles) {
  const TemporaryFolder folder;
  for (const Malformed& odd : odd_las_files()) {
    SCOPED_TRACE(odd.name);
    const auto file = open_points(folder.write("a.las", odd.make()));
    EXPECT_EQ(file->info().warnings.size(), odd.says.size());
    for (const std::string& warning : odd.says) expect_warning(file->info(), warning);
    EXPECT_EQ(read_all(*file).size(), file->size());
  }
}

}  // namespace
}  // namespace btms::test
