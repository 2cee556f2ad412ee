// Every way a LAS file can lie, and what we say to it.
#include <limits>

#include "tests/io/points/las_bytes.h"

namespace btms::test {
namespace {

struct BadLas {
  const char* name;
  std::vector<std::string> says;
  std::function<Bytes()> make;
};

Bytes changed(const LasSpec& spec, const std::function<void(Bytes&)>& change) {
  Bytes bytes = las_bytes(spec);
  change(bytes);
  return bytes;
}

LasSpec with_vlr() {
  LasSpec spec;
  spec.vlrs = {{"someone", 1, Bytes(10)}};
  return spec;
}

LasSpec with_evlr() {
  LasSpec spec = las_spec(4, 6);
  spec.evlrs = {{"someone", 1, Bytes(10)}};
  return spec;
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();

const std::vector<BadLas>& bad_files() {
  static const std::vector<BadLas> kFiles = {
      {"Empty", {"empty", "227"}, [] { return Bytes(); }},
      {"ShorterThanHeader", {"100 bytes", "227"}, [] { return changed({}, [](Bytes& b) { b.resize(100); }); }},
      {"ShorterThanLongHeader",
       {"header of 375"},
       [] { return changed(las_spec(4, 6), [](Bytes& b) { b.resize(300); }); }},
      {"Magic", {":0:", "LASF"}, [] { return changed({}, [](Bytes& b) { b[3] = 'G'; }); }},
      {"Version19", {":24:", "1.9", "1.0 to 1.4"}, [] { return changed({}, [](Bytes& b) { b[25] = 9; }); }},
      {"Version00", {"0.0"}, [] { return changed({}, [](Bytes& b) { b[24] = b[25] = 0; }); }},
      {"HeaderTooSmall",
       {":94:", "226", "227"},
       [] { return changed({}, [](Bytes& b) { store(&b[94], std::uint16_t{226}); }); }},
      {"HeaderTooSmall14",
       {"227", "375"},
       [] { return changed(las_spec(4, 6), [](Bytes& b) { store(&b[94], std::uint16_t{227}); }); }},
      {"HeaderPastEnd",
       {"65535", "287"},
       [] { return changed({}, [](Bytes& b) { store(&b[94], std::uint16_t{65535}); }); }},
      {"PointsPastEnd",
       {":96:", "4294967295"},
       [] { return changed({}, [](Bytes& b) { store(&b[96], 0xFFFF'FFFFu); }); }},
      {"PointsInHeader", {":96:", "226"}, [] { return changed({}, [](Bytes& b) { store(&b[96], 226u); }); }},
      {"PointsInVlr",
       {"VLR 1", "found room for 9"},
       [] { return changed(with_vlr(), [](Bytes& b) { store(&b[96], 227u + 63); }); }},
      {"CountTooLarge",
       {":107:", "declares 4 points", "found 3 whole"},
       [] { return changed({}, [](Bytes& b) { store(&b[107], 4u); }); }},
      {"CountTooLarge14",
       {":247:", "18446744073709551615", "found 3 whole"},
       [] { return changed(las_spec(4, 6), [](Bytes& b) { store(&b[247], ~std::uint64_t{0}); }); }},
      {"CountZero", {"0 points", "3 records"}, [] { return changed({}, [](Bytes& b) { store(&b[107], 0u); }); }},
      {"CountZeroBeforeEvlr",
       {"0 points", "3 records"},
       [] { return changed(with_evlr(), [](Bytes& b) { store(&b[247], std::uint64_t{0}); }); }},
      {"RecordTooShort",
       {":105:", "19", "at least 20"},
       [] { return changed({}, [](Bytes& b) { store(&b[105], std::uint16_t{19}); }); }},
      {"RecordZero", {"records of 0"}, [] { return changed({}, [](Bytes& b) { store(&b[105], std::uint16_t{0}); }); }},
      {"Format11", {":104:", "point format 11", "0 to 10"}, [] { return changed({}, [](Bytes& b) { b[104] = 11; }); }},
      {"Format127", {"point format 127"}, [] { return changed({}, [](Bytes& b) { b[104] = 127; }); }},
      {"CompressedBit", {"LAZ", "decompress"}, [] { return changed({}, [](Bytes& b) { b[104] = 0x81; }); }},
      {"LazVlr",
       {"LAZ", "decompress"},
       [] {
         LasSpec s;
         s.vlrs = {{"laszip encoded", 22204, Bytes(34)}};
         return las_bytes(s);
       }},
      {"ScaleZero", {":131:", "x scale 0"}, [] { return changed({}, [](Bytes& b) { store(&b[131], 0.0); }); }},
      {"ScaleNan", {"y scale nan"}, [] { return changed({}, [](Bytes& b) { store(&b[139], kNan); }); }},
      {"ScaleInf", {"z scale inf"}, [] { return changed({}, [](Bytes& b) { store(&b[147], kInf); }); }},
      {"ScaleNegative", {"x scale -0.01"}, [] { return changed({}, [](Bytes& b) { store(&b[131], -0.01); }); }},
      {"ScaleTiny", {"x scale 1e-300"}, [] { return changed({}, [](Bytes& b) { store(&b[131], 1e-300); }); }},
      {"OffsetNan", {":155:", "x offset nan"}, [] { return changed({}, [](Bytes& b) { store(&b[155], kNan); }); }},
      {"OffsetHuge", {"z offset 1e+300"}, [] { return changed({}, [](Bytes& b) { store(&b[171], 1e300); }); }},
      {"VlrCount", {"4294967295 VLRs"}, [] { return changed({}, [](Bytes& b) { store(&b[100], 0xFFFF'FFFFu); }); }},
      {"VlrCountOneTooMany",
       {"VLR 2 of 2"},
       [] {
         LasSpec s = with_vlr();
         s.vlrs[0].content.resize(100);
         return changed(s, [](Bytes& b) { store(&b[100], 2u); });
       }},
      {"VlrPastEnd",
       {":247:", "65535 bytes", "room for 10"},
       [] { return changed(with_vlr(), [](Bytes& b) { store(&b[227 + 20], std::uint16_t{65535}); }); }},
      {"EvlrStartWraps",
       {":235:", "18446744073709551600"},
       [] { return changed(with_evlr(), [](Bytes& b) { store(&b[235], std::uint64_t{0} - 16); }); }},
      {"EvlrCount",
       {"4294967295 EVLRs"},
       [] { return changed(with_evlr(), [](Bytes& b) { store(&b[243], 0xFFFF'FFFFu); }); }},
      {"EvlrLengthWraps",
       {"EVLR 1", "room for 10"},
       [] { return changed(with_evlr(), [](Bytes& b) { store(&b[b.size() - 50], ~std::uint64_t{0}); }); }},
      {"EvlrInPoints",
       {"EVLRs start at byte 376"},
       [] { return changed(with_evlr(), [](Bytes& b) { store(&b[235], std::uint64_t{376}); }); }},
      {"Truncated",
       {"found 2 whole records and a part of one"},
       [] { return changed({}, [](Bytes& b) { b.resize(b.size() - 1); }); }},
  };
  return kFiles;
}

class LasBadInput : public ::testing::TestWithParam<BadLas> {};
INSTANTIATE_TEST_SUITE_P(Table, LasBadInput, ::testing::ValuesIn(bad_files()),
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
