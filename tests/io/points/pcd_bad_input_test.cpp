// Every way a PCD file can lie, and what we say to it.
#include "tests/io/points/pcd_bytes.h"

namespace btms::test {
namespace {

struct BadPcd {
  const char* name;
  std::vector<std::string> says;
  Bytes bytes;
};

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

// A sound ascii file of two points with one thing replaced.
Bytes ascii(const std::string& what, const std::string& by) {
  return replaced(pcd_header("ascii", 2) + "1 2 3\n4 5 6\n", what, by) + Bytes();
}

Bytes huge_ascii() {
  const std::string text = replaced(pcd_header("ascii", 2) + "1 2 3\n4 5 6\n", "WIDTH 2", "WIDTH 1000000000000000000");
  return replaced(text, "POINTS 2", "POINTS 1000000000000000000") + Bytes();
}

Bytes many_wide_fields() {
  std::string fields = "x y z", size = "4 4 4", type = "F F F", count = "1 1 1";
  for (int i = 0; i < 40; ++i) {
    fields += " f" + std::to_string(i);
    size += " 8";
    type += " F";
    count += " 65536";
  }
  return pcd_header("binary", 1, fields, size, type, count) + Bytes();
}

Bytes sizes(std::uint32_t packed, std::uint32_t unpacked, Bytes data) {
  Bytes bytes;
  append(bytes, packed);
  append(bytes, unpacked);
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}

std::vector<BadPcd> bad_files() {
  return {
      {"Empty", {"empty"}, {}},
      {"NoDataLine", {"no DATA line"}, ascii("DATA ascii\n", "")},
      {"DataUnknown", {"line 11", "gzip"}, ascii("DATA ascii", "DATA gzip")},
      {"DataEndsFile", {"no DATA line"}, pcd_header("binary", 0).substr(0, 100) + Bytes()},
      {"PointsDiffer", {"line 10", "POINTS 3", "WIDTH 2 x HEIGHT 1"}, ascii("POINTS 2", "POINTS 3")},
      {"ProductOverflows",
       {"overflows"},
       replaced(replaced(pcd_header("binary", 2), "WIDTH 2", "WIDTH 9000000000000000000"), "HEIGHT 1",
                "HEIGHT 9000000000000000000") +
           Bytes()},
      {"WidthNegative", {"line 7", "-2"}, ascii("WIDTH 2", "WIDTH -2")},
      {"WidthHuge",
       {"1000000000000000000"},
       replaced(replaced(pcd_header("binary", 2), "WIDTH 2", "WIDTH 1000000000000000000"), "POINTS 2",
                "POINTS 1000000000000000000") +
           Bytes(24)},
      {"WidthHugeAscii", {"1000000000000000000 points", "found 2"}, huge_ascii()},
      {"WidthMissing", {"WIDTH with 0"}, ascii("WIDTH 2\n", "")},
      {"WidthFraction", {"2.5"}, ascii("WIDTH 2", "WIDTH 2.5")},
      {"Size3", {"line 4", "3 bytes"}, ascii("SIZE 4 4 4", "SIZE 4 4 3")},
      {"Size0", {"line 4", "found 0"}, ascii("SIZE 4 4 4", "SIZE 0 4 4")},
      {"Size16", {"line 4", "found 16"}, ascii("SIZE 4 4 4", "SIZE 4 16 4")},
      {"TypeX", {"line 5", "type X"}, ascii("TYPE F F F", "TYPE F X F")},
      {"FloatOf2", {"type F of 2"}, ascii("SIZE 4 4 4", "SIZE 4 4 2")},
      {"Count0", {"line 6", "found 0"}, ascii("COUNT 1 1 1", "COUNT 1 1 0")},
      {"CountHuge", {"line 6", "1000000000"}, ascii("COUNT 1 1 1", "COUNT 1 1 1000000000")},
      {"CountOfX", {"field x", "x 2"}, ascii("COUNT 1 1 1", "COUNT 2 1 1")},
      {"SizeMissing", {"SIZE has 0"}, ascii("SIZE 4 4 4\n", "")},
      {"SizeAndCountMissing", {"SIZE has 0"}, ascii("SIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n", "TYPE F F F\n")},
      {"TypeAndCountMissing", {"TYPE has 0"}, ascii("TYPE F F F\nCOUNT 1 1 1\n", "")},
      {"SizeTypeAndCountMissing", {"SIZE has 0"}, ascii("SIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n", "")},
      {"LengthsDiffer", {"TYPE has 2", "FIELDS 3"}, ascii("TYPE F F F", "TYPE F F")},
      {"CountsDiffer", {"COUNT has 4", "FIELDS 3"}, ascii("COUNT 1 1 1", "COUNT 1 1 1 1")},
      {"NoFields", {"no FIELDS"}, ascii("FIELDS x y z\n", "")},
      {"NoZ", {"field z found 0"}, ascii("FIELDS x y z", "FIELDS x y w")},
      {"XTwice", {"field x found 2"}, pcd_header("ascii", 1, "x y z x", "4 4 4 4", "F F F F", "1 1 1 1") + Bytes()},
      {"XInt8",
       {"line 5", "field x is I8", "float32 or float64"},
       pcd_header("binary", 1, "x y z", "1 4 4", "I F F") + Bytes(9)},
      {"KeywordTwice", {"POINTS a second time"}, ascii("DATA", "POINTS 2\nDATA")},
      {"RecordTooLong", {"16777216 bytes"}, many_wide_fields()},
      {"AsciiShort", {"declares 2 points", "found 1"}, ascii("4 5 6\n", "")},
      {"BinaryShort", {"declares 3 points of 12", "found 2 whole"}, pcd_header("binary", 3) + Bytes(35)},
      {"LongLine", {"line 13", "longer than 65536"}, ascii("4 5 6", std::string(100'000, '1'))},
      {"LongLineNoNewline", {"longer than 65536"}, pcd_header("ascii", 1) + std::string(1'000'000, ' ') + Bytes()},
      {"LongHeader", {"no DATA line"}, std::string(200'000, '#') + Bytes()},
      {"CompressedNoSizes", {"ends before"}, pcd_header("binary_compressed", 1) + Bytes(7)},
      {"CompressedSizeLies", {"999 bytes", "found 14"}, pcd_header("binary_compressed", 1) + sizes(999, 12, Bytes(14))},
      {"CompressedOutputLies",
       {"13 bytes when unpacked", "expected 12"},
       pcd_header("binary_compressed", 1) + sizes(14, 13, Bytes(14))},
      {"CompressedBomb",
       {"compressed data"},
       pcd_header("binary_compressed", 357'913'941) + sizes(12, 4'294'967'292, Bytes(12, 0x1F))},
      {"CompressedReference", {"before their start"}, pcd_header("binary_compressed", 1) + sizes(3, 12, {0xE0, 3, 5})},
      {"CompressedTooMany",
       {"declares 400000000 points"},
       pcd_header("binary_compressed", 400'000'000) + sizes(12, 505'032'704, Bytes(12))},
  };
}

class PcdBadInput : public ::testing::TestWithParam<BadPcd> {};
INSTANTIATE_TEST_SUITE_P(Table, PcdBadInput, ::testing::ValuesIn(bad_files()),
                         [](const auto& row) { return std::string(row.param.name); });

TEST_P(PcdBadInput, IsRefusedAtOpening) {
  const TemporaryFolder folder;
  const auto path = folder.write("bad.pcd", GetParam().bytes);
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
