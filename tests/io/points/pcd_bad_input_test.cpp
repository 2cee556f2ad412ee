// Every way a PCD file can lie, to the reader alone. What the program says is in tests/cli/malformed_test.cpp.
#include "tests/io/points/malformed_pcd.h"

namespace btms::test {
namespace {

class PcdBadInput : public ::testing::TestWithParam<Malformed> {};
INSTANTIATE_TEST_SUITE_P(Table, PcdBadInput, ::testing::ValuesIn(bad_pcd_files()),
                         [](const auto& row) { return std::string(row.param.name); });

TEST_P(PcdBadInput, IsRefusedAtOpening) {
  const TemporaryFolder folder;
  const auto path = folder.write("bad.pcd", GetParam().make());
  expect_error(ErrorCode::kBadInput, path, GetParam().says, [&] { open_points(path); });
}

TEST(PcdBadInput, NamesTheLineOfABadNumber) {
  const TemporaryFolder folder;
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
      {"4 1,5 6", {"line 15", "\"1,5\"", "for y"}}, {"4 5", {"line 15", "found 2 numbers", "expected 3"}},
      {"4 5 6 7", {"line 15", "found 4 numbers"}},  {"4 5 z", {"line 15", "\"z\"", "for z"}},
      {"4 5 0x10", {"line 15", "\"0x10\""}},
  };
  for (const auto& [line, says] : cases) {
    SCOPED_TRACE(line);
    std::string text = pcd_header("ascii", 1500) + "1 2 3\n\n1 2 3\n" + line + "\n";
    for (int i = 3; i < 1500; ++i) text += "1 2 3\n";
    const auto path = folder.write("bad.pcd", text);
    expect_error(ErrorCode::kBadInput, path, says, [&] { read_all(*open_points(path)); });
  }
}

TEST(PcdBadInput, NamesTheLineFarDownToo) {
  const TemporaryFolder folder;
  std::string text = pcd_header("ascii", 5000);
  for (int i = 0; i < 5000; ++i) text += i == 3500 ? "1 2\n" : "1 2 3\n\n";
  const auto file = open_points(folder.write("bad.pcd", text));
  PointBlock block;
  file->read(0, 3500, block);
  file->read(3501, 1499, block);
  expect_error(ErrorCode::kBadInput, file->path(), {"line " + std::to_string(11 + 2 * 3500 + 1)},
               [&] { file->read(3400, 200, block); });
}

// No prefix of a sound file may crash the reader or be taken for the whole.
TEST(PcdBadInput, EveryTruncationIsRefused) {
  const TemporaryFolder folder;
  for (const Bytes& whole :
       {pcd_header("binary", 2) + Bytes(24), pcd_header("binary_compressed", 2) + compressed(Bytes(24, 7))}) {
    for (std::size_t n = 0; n < whole.size(); ++n)
      EXPECT_THROW(open_points(folder.write("cut.pcd", std::span(whole).first(n))), Error) << n;
  }
}

}  // namespace
}  // namespace btms::test
