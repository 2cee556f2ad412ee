// Every way a LAS file can lie, to the reader alone. What the program says is in tests/cli/malformed_test.cpp.
#include "tests/io/points/malformed_las.h"

namespace btms::test {
namespace {

class LasBadInput : public ::testing::TestWithParam<Malformed> {};
INSTANTIATE_TEST_SUITE_P(Table, LasBadInput, ::testing::ValuesIn(bad_las_files()),
                         [](const auto& row) { return std::string(row.param.name); });

TEST_P(LasBadInput, IsRefusedByReaderAndClassReader) {
  const TemporaryFolder folder;
  const auto path = folder.write("bad.las", GetParam().make());
  expect_error(ErrorCode::kBadInput, path, GetParam().says, [&] { open_points(path); });
  expect_error(ErrorCode::kBadInput, path, GetParam().says, [&] { read_classes(path); });
}

// No prefix of a sound file may crash the reader or be taken for the whole.
TEST(LasBadInput, EveryTruncationIsRefused) {
  const TemporaryFolder folder;
  LasSpec spec = las_spec(4, 6);
  spec.vlrs = {{"LASF_Projection", 2112, text_bytes("PROJCS[\"x\"]")}};
  spec.evlrs = {{"someone", 1, Bytes(10)}};
  const Bytes whole = las_bytes(spec);
  for (std::size_t n = 0; n < whole.size(); ++n) {
    const auto path = folder.write("cut.las", std::span(whole).first(n));
    EXPECT_THROW(open_points(path), Error) << n;
  }
}

// One wild byte anywhere in the header: an error or a file that can be read to its end.
TEST(LasBadInput, EveryHeaderByteMayBeWild) {
  const TemporaryFolder folder;
  LasSpec spec = las_spec(4, 6);
  spec.vlrs = {geokeys({{1024, 1}, {3072, 32767}})};  // no code: a search in the PROJ database takes 4 ms
  spec.evlrs = {{"someone", 1, Bytes(10)}};
  const Bytes whole = las_bytes(spec);
  for (std::size_t at = 0; at < points_offset(spec); ++at) {
    for (const auto wild : std::initializer_list<std::uint8_t>{0x00, 0x7F, 0x80, 0xFF}) {
      Bytes bytes = whole;
      bytes[at] = wild;
      try {
        const auto file = open_points(folder.write("wild.las", bytes));
        EXPECT_LE(file->size(), 3u) << at;
        read_all(*file);
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kBadInput) << error.what();
      }
    }
  }
}

}  // namespace
}  // namespace btms::test
