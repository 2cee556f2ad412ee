#include <cmath>
#include <thread>

#include "tests/io/points/malformed_ply.h"

namespace btms::test {
namespace {

constexpr std::size_t kVertices = 5000;

// Whole eighths of a metre that fit a byte's neighbourhood: every type of number holds what it is given.
double vertex(std::size_t i, std::size_t axis) {
  const double v[] = {static_cast<double>(i) / 8, -static_cast<double>(i % 97), static_cast<double>(i % 13)};
  return v[axis];
}

template <typename T>
void put(Bytes& bytes, T value, bool big_endian) {
  append(bytes, value);
  if (big_endian) std::reverse(bytes.end() - sizeof(T), bytes.end());
}

const std::string kProperties =
    "property uchar intensity\nproperty double y\nproperty float64 x\nproperty short label\nproperty int8 z\n";
const std::string kFaces = "element face 2\nproperty list uchar int vertex_indices\nproperty float quality\n";
const std::string kCamera = "element camera 1\nproperty double focus\n";

// Faces and a camera before the points, an element behind them.
Bytes make(const std::string& format) {
  const std::string header =
      ply_header(format, kVertices, kProperties, kFaces + kCamera, "element edge 1\nproperty int a\n");
  if (format == "ascii") {
    std::string text = header + "3 1 2 3 0.5\n1 7 0.25\n\n35.5\n";
    for (std::size_t i = 0; i < kVertices; ++i)
      text += "9 " + std::to_string(vertex(i, 1)) + "\t" + std::to_string(vertex(i, 0)) + " 2 " +
              std::to_string(vertex(i, 2)) + (i % 100 == 0 ? "\r\n\n" : "\n");
    return text_bytes(text + "12\n");
  }
  const bool big = format == "binary_big_endian";
  Bytes bytes;
  for (const int length : {3, 1}) {
    put(bytes, static_cast<std::uint8_t>(length), big);
    for (int i = 0; i < length; ++i) put(bytes, 1'000'000 + i, big);
    put(bytes, 0.5F, big);
  }
  put(bytes, 35.5, big);
  for (std::size_t i = 0; i < kVertices; ++i) {
    put(bytes, static_cast<std::uint8_t>(i), big);
    put(bytes, vertex(i, 1), big);
    put(bytes, vertex(i, 0), big);
    put(bytes, static_cast<std::int16_t>(i), big);
    put(bytes, static_cast<std::int8_t>(vertex(i, 2)), big);
  }
  put(bytes, 12, big);
  return header + bytes;
}

void expect_vertices(const PointBlock& block, std::size_t first) {
  for (std::size_t i = 0; i < block.size(); ++i) {
    ASSERT_EQ(block.x_mm[i], std::llrint(1000 * vertex(first + i, 0))) << first + i;
    ASSERT_EQ(block.y_mm[i], std::llrint(1000 * vertex(first + i, 1))) << first + i;
    ASSERT_EQ(block.z_mm[i], std::llrint(1000 * vertex(first + i, 2))) << first + i;
  }
}

class Ply : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(EveryEncoding, Ply, ::testing::Values("ascii", "binary_little_endian", "binary_big_endian"),
                         [](const auto& row) { return std::string(row.param); });

TEST_P(Ply, GivesThePoints) {
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("a.ply", make(GetParam())));
  EXPECT_TRUE(file->info().warnings.empty()) << file->info().warnings.front();
  ASSERT_EQ(file->size(), kVertices);
  expect_vertices(read_all(*file), 0);
  PointBlock block;
  for (const std::size_t first : {std::size_t{1}, std::size_t{1023}, kVertices - 1, kVertices}) {
    file->read(first, std::min<std::size_t>(2000, kVertices - first), block);
    expect_vertices(block, first);
  }
}

TEST_P(Ply, IsSafeToReadFromManyThreads) {
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("a.ply", make(GetParam())));
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      PointBlock block;
      for (std::size_t first = 333 * t; first + 500 < kVertices; first += 999) {
        file->read(first, 500, block);
        for (std::size_t i = 0; i < 500; ++i)
          wrong += block.x_mm[i] != std::llrint(1000 * vertex(first + i, 0)) ? 1 : 0;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST_P(Ply, NoticesThatTheFileChanged) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.ply", make(GetParam()));
  const auto file = open_points(path);
  std::filesystem::resize_file(path, 2000);
  PointBlock block;
  EXPECT_THROW(file->read(kVertices - 10, 10, block), Error);
}

// Whatever is cut away of the points, the element behind them aside.
TEST_P(Ply, EveryTruncationIsRefused) {
  const TemporaryFolder folder;
  const std::string properties = "property float x\nproperty float y\nproperty float z\n";
  const bool text = GetParam() == std::string("ascii");
  const Bytes whole = ply_header(GetParam(), 2, properties, kFaces) +
                      (text ? text_bytes("0 1\n0 1\n1 2 3\n4 5 6\n") : Bytes(2 * 5 + 24));
  for (std::size_t n = 0; n + (text ? 6 : 0) < whole.size(); ++n)
    EXPECT_THROW(open_points(folder.write("cut.ply", std::span(whole).first(n))), Error) << n;
}

TEST(PlyPoints, DropWhatIsNotFinite) {
  const TemporaryFolder folder;
  const auto file = open_points(folder.write("a.ply", ply_header("ascii", 3) + "nan 1 2\n1 inf 2\n1e30 2 3\n"));
  const PointBlock block = read_all(*file);
  EXPECT_EQ(block.not_finite, 2U);
  EXPECT_EQ(block.out_of_range, 1U);
}

TEST(PlyPoints, FarAwayAsFloatsAreWarnedOf) {
  const TemporaryFolder folder;
  Bytes far;
  for (const float v : {500'000.F, 4'000'000.F, 1.F}) append(far, v);
  expect_warning(open_points(folder.write("a.ply", ply_header("binary_little_endian", 1) + far))->info(), "float32");
}

class PlyBadInput : public ::testing::TestWithParam<Malformed> {};
INSTANTIATE_TEST_SUITE_P(Table, PlyBadInput, ::testing::ValuesIn(bad_ply_files()),
                         [](const auto& row) { return std::string(row.param.name); });

TEST_P(PlyBadInput, IsRefusedAtOpening) {
  const TemporaryFolder folder;
  const auto path = folder.write("bad.ply", GetParam().make());
  expect_error(ErrorCode::kBadInput, path, GetParam().says, [&] { open_points(path); });
}

}  // namespace
}  // namespace btms::test
