#include <cmath>
#include <limits>
#include <thread>

#include "tests/io/points/malformed_pcd.h"

namespace btms::test {
namespace {

constexpr std::size_t kPoints = 70'000;
constexpr const char* kKinds[] = {"ascii", "binary", "binary_compressed"};

// Coordinates of point i in whole 1/64 m, which every encoding can hold exactly.
double at(std::size_t i, std::size_t axis) {
  const double v[] = {static_cast<double>(i) / 64, -static_cast<double>(i % 977) / 32, static_cast<double>(i % 13)};
  return v[axis];
}

// A field before, between and after x, y, z: u16, float[2], u8. z is a double where asked for.
template <typename X, typename Z>
Bytes make(const std::string& kind) {
  const std::string size =
      "2 " + std::to_string(sizeof(X)) + " " + std::to_string(sizeof(X)) + " 4 " + std::to_string(sizeof(Z)) + " 1";
  const std::string header = pcd_header(kind, kPoints, "ring x y normal z flag", size, "U F F F F U", "1 1 1 2 1 1");
  if (kind == "ascii") {
    std::string text = header;
    for (std::size_t i = 0; i < kPoints; ++i) {
      text += std::to_string(i) + " " + std::to_string(at(i, 0)) + "\t" + std::to_string(at(i, 1)) + " nan 0.5 " +
              std::to_string(at(i, 2)) + " 1\n";
      if (i % 1000 == 17) text += i % 2 == 0 ? "\n" : " \t\r\n";
    }
    return Bytes(text.begin(), text.end());
  }
  Bytes columns, records;
  const auto add = [](Bytes& to, std::size_t field, std::size_t i) {
    switch (field) {
      case 0:
        return append(to, static_cast<std::uint16_t>(i));
      case 1:
        return append(to, static_cast<X>(at(i, 0)));
      case 2:
        return append(to, static_cast<X>(at(i, 1)));
      case 3:
        append(to, 0.25F);
        return append(to, static_cast<float>(i));
      case 4:
        return append(to, static_cast<Z>(at(i, 2)));
      default:
        return append(to, static_cast<std::uint8_t>(i));
    }
  };
  if (kind == "binary") {
    for (std::size_t i = 0; i < kPoints; ++i)
      for (std::size_t field = 0; field < 6; ++field) add(records, field, i);
    return header + records;
  }
  for (std::size_t field = 0; field < 6; ++field)
    for (std::size_t i = 0; i < kPoints; ++i) add(columns, field, i);
  return header + compressed(columns);
}

void expect_points(const PointBlock& block, std::size_t first) {
  for (std::size_t i = 0; i < block.size(); ++i) {
    ASSERT_EQ(block.x_mm[i], std::llrint(1000 * at(first + i, 0))) << first + i;
    ASSERT_EQ(block.y_mm[i], std::llrint(1000 * at(first + i, 1))) << first + i;
    ASSERT_EQ(block.z_mm[i], std::llrint(1000 * at(first + i, 2))) << first + i;
  }
}

class EveryEncoding : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Pcd, EveryEncoding, ::testing::ValuesIn(kKinds),
                         [](const auto& row) { return std::string(row.param); });

TEST_P(EveryEncoding, GivesThePoints) {
  const TemporaryFolder folder;
  for (const Bytes& bytes :
       {make<float, float>(GetParam()), make<float, double>(GetParam()), make<double, double>(GetParam())}) {
    const auto file = open_points(folder.write("a.pcd", bytes));
    EXPECT_EQ(file->info().format, std::string("PCD 0.7 ") + GetParam());
    EXPECT_TRUE(file->info().warnings.empty()) << file->info().warnings.front();
    ASSERT_EQ(file->size(), kPoints);
    expect_points(read_all(*file), 0);
    PointBlock block;
    for (const auto& [first, count] : {std::pair<std::size_t, std::size_t>{0, 1},
                                       {kPoints - 1, 1},
                                       {1023, 3},
                                       {32'768, 32'768},
                                       {kPoints, 0},
                                       {0, 0}}) {
      file->read(first, count, block);
      ASSERT_EQ(block.size(), count);
      expect_points(block, first);
    }
  }
}

TEST_P(EveryEncoding, IsSafeToReadFromManyThreads) {
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("a.pcd", make<float, float>(GetParam())));
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      PointBlock block;
      for (std::size_t first = 333 * t; first + 5000 < kPoints; first += 9999) {
        file->read(first, 5000, block);
        for (std::size_t i = 0; i < 5000; ++i) wrong += block.x_mm[i] != std::llrint(1000 * at(first + i, 0)) ? 1 : 0;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST_P(EveryEncoding, NoticesThatTheFileChanged) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.pcd", make<float, float>(GetParam()));
  const auto file = open_points(path);
  std::filesystem::resize_file(path, 2000);
  PointBlock block;
  expect_error(ErrorCode::kBadInput, path, {"changed while read"}, [&] { file->read(100, 1000, block); });
}

// Too large to be kept unpacked: each read unpacks its part.
TEST(Pcd, ReadsPartsOfALargeCompressedFile) {
  constexpr std::size_t kMany = 23'000'000, kColumns = 12 * kMany;
  Bytes packed = {0, 0};  // one zero, then copies of what came before
  std::size_t unpacked = 1;
  for (; kColumns - unpacked >= 264; unpacked += 264) packed.insert(packed.end(), {0xE0, 0xFF, 0x00});
  for (; unpacked < kColumns; ++unpacked) packed.insert(packed.end(), {0, 0});
  Bytes bytes;
  append(bytes, static_cast<std::uint32_t>(packed.size()));
  append(bytes, static_cast<std::uint32_t>(kColumns));
  bytes.insert(bytes.end(), packed.begin(), packed.end());
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("a.pcd", pcd_header("binary_compressed", kMany) + bytes));
  PointBlock block;
  file->read(kMany - 5000, 5000, block);
  EXPECT_EQ(block.x_mm, std::vector<std::int64_t>(5000, 0));
  EXPECT_EQ(block.z_mm, std::vector<std::int32_t>(5000, 0));
}

TEST(Pcd, OnlyBinaryFloatsHaveLostPrecision) {
  const TemporaryFolder folder;
  const auto ascii = open_points(folder.write("a.pcd", pcd_header("ascii", 1) + "5432109.876 4321098.765 1\n"));
  EXPECT_TRUE(ascii->info().warnings.empty());
  EXPECT_EQ(read_all(*ascii).x_mm[0], 5'432'109'876);
  Bytes bytes;
  for (const float v : {5432109.876f, 4321098.765f, 1.0f}) append(bytes, v);
  expect_warning(open_points(folder.write("b.pcd", pcd_header("binary", 1) + bytes))->info(), "float32");
}

TEST(Pcd, DropsWhatIsNoPlace) {
  const TemporaryFolder folder;
  const std::string text =
      pcd_header("ascii", 7) + "1e-999 0 0\nnan 0 0\n0 -inf 0\n+1.5 -0 1e-310\n1e30 0 0\n0 0 1e999\n0 0 2e5\n";
  const PointBlock block = read_all(*open_points(folder.write("a.pcd", text)));
  EXPECT_EQ(block.not_finite, 3u);  // 1e999 is infinite
  EXPECT_EQ(block.out_of_range, 2u);
  EXPECT_EQ(block.x_mm[0], 0);
  EXPECT_EQ(block.x_mm[3], 1500);
}

TEST(Pcd, AcceptsDosLinesOldNamesAndMissingDefaults) {
  const TemporaryFolder folder;
  const std::string text =
      "VERSION .6\r\nCOLUMNS x y z\r\nSIZE 4 4 4\r\nTYPE F F F\r\nWIDTH 1\r\nDATA ascii\r\n1 2 3\r\n";
  const auto file = open_points(folder.write("a.pcd", text));
  EXPECT_EQ(file->info().format, "PCD .6 ascii");
  EXPECT_EQ(read_all(*file).z_mm[0], 3000);
}

TEST(Pcd, ReadsTheLastLineWithoutNewline) {
  const TemporaryFolder folder;
  EXPECT_EQ(read_all(*open_points(folder.write("a.pcd", pcd_header("ascii", 2) + "1 2 3\n4 5 6"))).z_mm[1], 6000);
}

TEST(Pcd, AcceptsOddFilesWithAWarning) {
  const TemporaryFolder folder;
  for (const Malformed& odd : odd_pcd_files()) {
    SCOPED_TRACE(odd.name);
    const auto file = open_points(folder.write("a.pcd", odd.make()));
    EXPECT_EQ(file->info().warnings.size(), 1u);
    expect_warning(file->info(), odd.says[0]);
    EXPECT_EQ(read_all(*file).dropped(), 0u);
  }
}

TEST(Pcd, KeepsFarDoublesWithoutAWarning) {
  const TemporaryFolder folder;
  Bytes data;
  for (const double v : {691'234.567, 5'334'000.001, 512.25}) append(data, v);
  const auto file = open_points(folder.write("a.pcd", pcd_header("binary", 1, "x y z", "8 8 8") + data));
  EXPECT_TRUE(file->info().warnings.empty());
  const PointBlock block = read_all(*file);
  EXPECT_EQ(block.x_mm[0], 691'234'567);
  EXPECT_EQ(block.y_mm[0], 5'334'000'001);
}

TEST(PcdLabels, AreBytes) {
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("a.pcd", pcd_header("ascii", 4) + "1 2 3\n1 2 3\n1 2 3\n1 2 3\n"));
  const auto writer = create_labels(*file, folder.path());
  const Label labels[] = {Label::kTerrain, Label::kObstacle, Label::kBelow, Label::kDropped};
  writer->write(0, labels);
  writer->commit();
  EXPECT_EQ(read_bytes(folder / "a.labels"), (Bytes{1, 0, 0, 0}));
}

}  // namespace
}  // namespace btms::test
