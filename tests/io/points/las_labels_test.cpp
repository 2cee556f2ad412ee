#include <random>
#include <thread>

#include "tests/io/points/las_bytes.h"

namespace btms::test {
namespace {

constexpr Label kAll[] = {Label::kDropped, Label::kTerrain, Label::kObstacle, Label::kBelow};

std::vector<Label> random_labels(std::size_t n, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Label> labels(n);
  for (Label& label : labels) label = kAll[random() % 4];
  return labels;
}

// What the copy must be: the input with nothing but class bits changed.
Bytes expected_copy(const LasSpec& spec, Bytes bytes, const std::vector<Label>& labels) {
  for (std::size_t i = 0; i < labels.size(); ++i) {
    std::uint8_t& byte = bytes[points_offset(spec) + i * record_bytes(spec) + class_offset(spec.format)];
    const std::uint8_t bits = class_bits(spec.format);
    const auto set = [&](int value) { byte = static_cast<std::uint8_t>((byte & ~bits) | value); };
    if (labels[i] == Label::kTerrain) set(2);
    if (labels[i] == Label::kObstacle) set(1);
    if (labels[i] == Label::kBelow) set(7);
  }
  return bytes;
}

class EveryFormatLabelled : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(LasLabels, EveryFormatLabelled, ::testing::Range(0, 11));

TEST_P(EveryFormatLabelled, ChangesNothingButTheClass) {
  const auto format = static_cast<std::uint8_t>(GetParam());
  const TemporaryFolder folder;
  LasSpec spec = las_spec(format < 6 ? 2 : 4, format);
  spec.extra_bytes = 5;
  spec.vlrs = {{"someone", 7, Bytes(33, 9)}};
  if (spec.minor == 4) spec.evlrs = {{"someone", 8, Bytes(70'000, 3)}};
  spec.xyz.assign(3000, {1, 2, 3});
  Bytes bytes = las_bytes(spec);
  if (spec.minor != 4) bytes.insert(bytes.end(), 99, 0xAB);  // trailing bytes stay, too
  const auto file = open_points(folder.write("a.las", bytes));
  const std::vector<Label> labels = random_labels(3000, 1);
  const auto writer = create_labels(*file, folder / "out");
  writer->write(0, std::span(labels).first(1234));
  writer->write(1234, std::span(labels).subspan(1234));
  writer->commit();
  EXPECT_EQ(writer->path(), folder / "out" / "a.las");
  EXPECT_EQ(read_bytes(writer->path()), expected_copy(spec, bytes, labels));
}

TEST_P(EveryFormatLabelled, RecordsThatHaveBeenReadAreNotReadAgain) {
  const auto format = static_cast<std::uint8_t>(GetParam());
  const TemporaryFolder folder;
  LasSpec spec = las_spec(format < 6 ? 2 : 4, format);
  spec.extra_bytes = 90;  // blocks of several reads
  spec.xyz.assign(10'000, {1, 2, 3});
  for (std::size_t i = 0; i < spec.xyz.size(); ++i) spec.xyz[i][0] = static_cast<std::int32_t>(i);
  const Bytes bytes = las_bytes(spec);
  const auto file = open_points(folder.write("a.las", bytes));
  const std::vector<Label> labels = random_labels(10'000, 3);
  const auto writer = create_labels(*file, folder / "out");
  PointBlock block;
  block.keep_records = true;
  const std::size_t shares[] = {6000, 4000};  // the second leaves more in the buffer than it needs
  for (std::size_t first = 0; const std::size_t n : shares) {
    file->read(first, n, block);
    writer->write(first, std::span(labels).subspan(first, n), block);
    first += n;
  }
  writer->commit();
  EXPECT_EQ(read_bytes(writer->path()), expected_copy(spec, bytes, labels));
}

TEST(LasLabels, ABlockNeedsItsRecords) {
  const TemporaryFolder folder;
  LasSpec spec;
  spec.xyz.assign(4, {1, 2, 3});
  const auto file = open_points(folder.write("a.las", las_bytes(spec)));
  const auto writer = create_labels(*file, folder / "out");
  PointBlock block;
  file->read(0, 4, block);
  EXPECT_THROW(writer->write(0, kAll, block), Error);
}

TEST(LasLabels, AreReadBackAsClasses) {
  const TemporaryFolder folder;
  LasSpec spec = las_spec(4, 6);
  spec.xyz.assign(4, {1, 2, 3});
  const Bytes bytes = las_bytes(spec);
  const auto file = open_points(folder.write("a.las", bytes));
  const auto writer = create_labels(*file, folder / "out");
  writer->write(0, kAll);
  writer->commit();
  EXPECT_EQ(read_classes(writer->path()), (std::vector<std::uint32_t>{bytes[points_offset(spec) + 16], 2, 1, 7}));
}

TEST(LasLabels, AreWrittenByManyThreads) {
  const TemporaryFolder folder;
  LasSpec spec;
  spec.xyz.assign(100'000, {1, 2, 3});
  const Bytes bytes = las_bytes(spec);
  const auto file = open_points(folder.write("a.las", bytes));
  const std::vector<Label> labels = random_labels(100'000, 2);
  const auto writer = create_labels(*file, folder / "out");
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (std::size_t first = t * 1000; first < labels.size(); first += 4000)
        writer->write(first, std::span(labels).subspan(first, 1000));
    });
  }
  for (std::thread& thread : threads) thread.join();
  writer->commit();
  EXPECT_EQ(read_bytes(writer->path()), expected_copy(spec, bytes, labels));
}

TEST(LasLabels, LeaveNothingBehindWithoutCommit) {
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("a.las", las_bytes({})));
  {
    const auto writer = create_labels(*file, folder / "out");
    writer->write(0, std::span(kAll).first(3));
    EXPECT_LE(files_in(folder / "out"), 1u);  // a temporary name, where files must have one
    EXPECT_FALSE(std::filesystem::exists(writer->path()));
  }
  EXPECT_EQ(files_in(folder / "out"), 0u);
}

TEST(LasLabels, AreNotPublishedWhenSomeAreMissing) {
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("a.las", las_bytes({})));
  const auto writer = create_labels(*file, folder / "out");
  writer->write(0, std::span(kAll).first(2));
  expect_error(ErrorCode::kFailed, writer->path(), {"2 points, expected 3"}, [&] { writer->commit(); });
  EXPECT_FALSE(std::filesystem::exists(writer->path()));
}

TEST(LasLabels, NeverReplaceTheInput) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.las", las_bytes({}));
  const auto file = open_points(path);
  expect_error(ErrorCode::kUsage, path, {"replace the input"}, [&] { create_labels(*file, folder.path()); });
  std::filesystem::create_directory_symlink(folder.path(), folder / "link");
  EXPECT_THROW(create_labels(*file, folder / "link"), Error);
  EXPECT_EQ(read_bytes(path), las_bytes({}));
}

TEST(LasLabels, NoticeThatTheInputChanged) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.las", las_bytes({}));
  const auto file = open_points(path);
  const auto writer = create_labels(*file, folder / "out");
  std::filesystem::resize_file(path, 250);
  expect_error(ErrorCode::kBadInput, path, {"changed while read"}, [&] { writer->write(0, std::span(kAll).first(3)); });
}

TEST(LasLabels, NeedAFolderThatCanBeWritten) {
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("a.las", las_bytes({})));
  const auto occupied = folder.write("occupied", std::string("a file"));
  expect_error(ErrorCode::kFailed, occupied, {"cannot make the folder"}, [&] { create_labels(*file, occupied); });
}

}  // namespace
}  // namespace btms::test
