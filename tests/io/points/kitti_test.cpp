#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/io/points/files.h"

namespace btms::test {
namespace {

using Floats = std::vector<float>;

Bytes bytes_of(const Floats& numbers) {
  Bytes bytes(4 * numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) store(&bytes[4 * i], numbers[i]);
  return bytes;
}

Floats scan(int points) {
  Floats numbers;
  for (int i = 0; i < points; ++i) {
    const float angle = 0.1F * static_cast<float>(i);
    for (const float v : {20.123F * std::cos(angle), 20.123F * std::sin(angle), -1.73F + 0.01F * angle, 0.5F})
      numbers.push_back(v);
  }
  return numbers;
}

TEST(Kitti, RoundsToTheNearestMillimetre) {
  const TemporaryFolder folder;
  const Floats numbers = {1.0F,    -2.0F,    0.0005F, 9,   // 0.0005F is a little above half a millimetre
                          0.5F,    0.0625F,  -0.0F,   9,   // 62.5 mm: to even
                          0.1875F, -0.1875F, 1e-42F,  9};  // 187.5 mm: to even
  const auto file = open_points(folder.write("a.bin", bytes_of(numbers)));
  const PointBlock block = read_all(*file);
  EXPECT_EQ(file->info().format, "KITTI scan");
  EXPECT_EQ(block.x_mm, (std::vector<std::int64_t>{1000, 500, 188}));
  EXPECT_EQ(block.y_mm, (std::vector<std::int64_t>{-2000, 62, -188}));
  EXPECT_EQ(block.z_mm, (std::vector<std::int32_t>{1, 0, 0}));
}

TEST(Kitti, DropsWhatIsNoPlace) {
  const TemporaryFolder folder;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  Floats numbers = scan(20);
  numbers[4 * 3] = kNan;
  numbers[4 * 5 + 2] = -kInf;
  numbers[4 * 7 + 1] = 1e30F;
  numbers[4 * 9 + 2] = 2e5F;
  numbers[4 * 11 + 3] = kNan;  // the intensity is not read
  const PointBlock block = read_all(*open_points(folder.write("a.bin", bytes_of(numbers))));
  EXPECT_EQ(block.not_finite, 2u);
  EXPECT_EQ(block.out_of_range, 2u);
  for (std::size_t i = 0; i < 20; ++i)
    EXPECT_EQ(block.x_mm[i] == PointBlock::kDroppedX, i == 3 || i == 5 || i == 7 || i == 9) << i;
}

TEST(Kitti, AcceptsAnEmptyScan) {
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("a.bin", Bytes()));
  EXPECT_EQ(file->size(), 0u);
  expect_warning(file->info(), "empty");
  EXPECT_EQ(read_all(*file).size(), 0u);
  const auto writer = create_labels(*file, folder / "out");
  writer->commit();
  EXPECT_EQ(read_bytes(folder / "out" / "a.label").size(), 0u);
}

TEST(Kitti, RefusesHalfAPoint) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.bin", Bytes(40));
  expect_error(ErrorCode::kBadInput, path, {"40 bytes", "multiple of 16"}, [&] { open_points(path); });
}

TEST(Kitti, RefusesSwappedBytes) {
  const TemporaryFolder folder;
  for (const int points : {100, 5000}) {
    Bytes bytes = bytes_of(scan(points));
    for (std::size_t i = 0; i < bytes.size(); i += 4)
      std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(i), bytes.begin() + static_cast<std::ptrdiff_t>(i) + 4);
    const auto path = folder.write("a.bin", bytes);
    expect_error(ErrorCode::kBadInput, path, {"looks byte-swapped"}, [&] { open_points(path); });
  }
}

TEST(Kitti, NoticesThatTheFileChanged) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.bin", bytes_of(scan(100)));
  const auto file = open_points(path);
  std::filesystem::resize_file(path, 160);
  PointBlock block;
  expect_error(ErrorCode::kBadInput, path, {"changed while read"}, [&] { file->read(0, 100, block); });
}

TEST(KittiLabels, AreSemanticKittiIds) {
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("000123.bin", bytes_of(scan(4))));
  const auto writer = create_labels(*file, folder.path());
  EXPECT_EQ(writer->path(), folder / "000123.label");
  const Label labels[] = {Label::kTerrain, Label::kDropped, Label::kObstacle, Label::kBelow};
  writer->write(2, std::span(labels).subspan(2));
  writer->write(0, std::span(labels).first(2));
  EXPECT_FALSE(std::filesystem::exists(writer->path()));
  writer->commit();
  EXPECT_EQ(read_bytes(writer->path()).size(), 16u);
  EXPECT_EQ(read_classes(writer->path()), (std::vector<std::uint32_t>{40, 0, 99, 99}));
}

TEST(KittiLabels, AreNotPublishedWhenSomeAreMissing) {
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("a.bin", bytes_of(scan(4))));
  {
    const auto writer = create_labels(*file, folder / "out");
    expect_error(ErrorCode::kFailed, writer->path(), {"0 points, expected 4"}, [&] { writer->commit(); });
  }
  EXPECT_EQ(files_in(folder / "out"), 0u);
}

TEST(Classes, KeepTheLowerHalfOfKittiLabels) {
  const TemporaryFolder folder;
  Bytes bytes(8);
  store(&bytes[0], 0x0007'0028u);
  store(&bytes[4], 0x0000'0063u);
  EXPECT_EQ(read_classes(folder.write("a.label", bytes)), (std::vector<std::uint32_t>{40, 99}));
  EXPECT_EQ(read_classes(folder.write("a.labels", Bytes{0, 1, 255})), (std::vector<std::uint32_t>{0, 1, 255}));
  const auto odd = folder.write("odd.label", Bytes(7));
  expect_error(ErrorCode::kBadInput, odd, {"7 bytes", "multiple of 4"}, [&] { read_classes(odd); });
  const auto scan_file = folder.write("a.bin", Bytes(16));
  expect_error(ErrorCode::kUsage, scan_file, {".bin", ".label"}, [&] { read_classes(scan_file); });
}

}  // namespace
}  // namespace btms::test
