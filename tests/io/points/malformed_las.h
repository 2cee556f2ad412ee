// Every way a LAS file can lie, and what we say to it.
#pragma once

#include <limits>

#include "tests/io/points/las_bytes.h"
#include "tests/io/points/malformed.h"

namespace btms::test {

inline Bytes changed(const LasSpec& spec, const std::function<void(Bytes&)>& change) {
  Bytes bytes = las_bytes(spec);
  change(bytes);
  return bytes;
}

inline LasSpec with_vlr() {
  LasSpec spec;
  spec.vlrs = {{"someone", 1, Bytes(10)}};
  return spec;
}

inline LasSpec with_evlr() {
  LasSpec spec = las_spec(4, 6);
  spec.evlrs = {{"someone", 1, Bytes(10)}};
  return spec;
}

inline constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN(),
                        kInfinity = std::numeric_limits<double>::infinity();

inline LasSpec with_crs(const Vlr& vlr) {
  LasSpec spec;
  spec.vlrs = {vlr};
  return spec;
}

inline const std::vector<Malformed>& bad_las_files() {
  static const std::vector<Malformed> kFiles = {
      {1, "Empty", {"empty", "227"}, [] { return Bytes(); }},
      {2, "ShorterThanHeader", {"100 bytes", "227"}, [] { return changed({}, [](Bytes& b) { b.resize(100); }); }},
      {2,
       "ShorterThanLongHeader",
       {"header of 375"},
       [] { return changed(las_spec(4, 6), [](Bytes& b) { b.resize(300); }); }},
      {3, "Magic", {":0:", "LASF"}, [] { return changed({}, [](Bytes& b) { b[3] = 'G'; }); }},
      {4, "Version19", {":24:", "1.9", "1.0 to 1.4"}, [] { return changed({}, [](Bytes& b) { b[25] = 9; }); }},
      {4, "Version00", {"0.0"}, [] { return changed({}, [](Bytes& b) { b[24] = b[25] = 0; }); }},
      {5,
       "HeaderTooSmall",
       {":94:", "226", "227"},
       [] { return changed({}, [](Bytes& b) { store(&b[94], std::uint16_t{226}); }); }},
      {5,
       "HeaderTooSmall14",
       {"227", "375"},
       [] { return changed(las_spec(4, 6), [](Bytes& b) { store(&b[94], std::uint16_t{227}); }); }},
      {5,
       "HeaderPastEnd",
       {"65535", "287"},
       [] { return changed({}, [](Bytes& b) { store(&b[94], std::uint16_t{65535}); }); }},
      {6,
       "PointsPastEnd",
       {":96:", "4294967295"},
       [] { return changed({}, [](Bytes& b) { store(&b[96], 0xFFFF'FFFFu); }); }},
      {6, "PointsInHeader", {":96:", "226"}, [] { return changed({}, [](Bytes& b) { store(&b[96], 226u); }); }},
      {6,
       "PointsInVlr",
       {"VLR 1", "found room for 9"},
       [] { return changed(with_vlr(), [](Bytes& b) { store(&b[96], 227u + 63); }); }},
      {7,
       "CountTooLarge",
       {":107:", "declares 4 points", "found 3 whole"},
       [] { return changed({}, [](Bytes& b) { store(&b[107], 4u); }); }},
      {7,
       "CountTooLarge14",
       {":247:", "18446744073709551615", "found 3 whole"},
       [] { return changed(las_spec(4, 6), [](Bytes& b) { store(&b[247], ~std::uint64_t{0}); }); }},
      {8, "CountZero", {"0 points", "3 records"}, [] { return changed({}, [](Bytes& b) { store(&b[107], 0u); }); }},
      {8,
       "CountZeroBeforeEvlr",
       {"0 points", "3 records"},
       [] { return changed(with_evlr(), [](Bytes& b) { store(&b[247], std::uint64_t{0}); }); }},
      {11,
       "RecordTooShort",
       {":105:", "19", "at least 20"},
       [] { return changed({}, [](Bytes& b) { store(&b[105], std::uint16_t{19}); }); }},
      {11,
       "RecordZero",
       {"records of 0"},
       [] { return changed({}, [](Bytes& b) { store(&b[105], std::uint16_t{0}); }); }},
      {12,
       "Format11",
       {":104:", "point format 11", "0 to 10"},
       [] { return changed({}, [](Bytes& b) { b[104] = 11; }); }},
      {12, "Format127", {"point format 127"}, [] { return changed({}, [](Bytes& b) { b[104] = 127; }); }},
      {13, "CompressedBit", {"LAZ", "call the file .laz"}, [] { return changed({}, [](Bytes& b) { b[104] = 0x81; }); }},
      {13,
       "LazVlr",
       {"LAZ", "call the file .laz"},
       [] {
         LasSpec s;
         s.vlrs = {{"laszip encoded", 22204, Bytes(34)}};
         return las_bytes(s);
       }},
      {14, "ScaleZero", {":131:", "x scale 0"}, [] { return changed({}, [](Bytes& b) { store(&b[131], 0.0); }); }},
      {14, "ScaleNan", {"y scale nan"}, [] { return changed({}, [](Bytes& b) { store(&b[139], kNotANumber); }); }},
      {14, "ScaleInf", {"z scale inf"}, [] { return changed({}, [](Bytes& b) { store(&b[147], kInfinity); }); }},
      {14, "ScaleNegative", {"x scale -0.01"}, [] { return changed({}, [](Bytes& b) { store(&b[131], -0.01); }); }},
      {14, "ScaleTiny", {"x scale 1e-300"}, [] { return changed({}, [](Bytes& b) { store(&b[131], 1e-300); }); }},
      {15,
       "OffsetNan",
       {":155:", "x offset nan"},
       [] { return changed({}, [](Bytes& b) { store(&b[155], kNotANumber); }); }},
      {15, "OffsetHuge", {"z offset 1e+300"}, [] { return changed({}, [](Bytes& b) { store(&b[171], 1e300); }); }},
      {17, "VlrCount", {"4294967295 VLRs"}, [] { return changed({}, [](Bytes& b) { store(&b[100], 0xFFFF'FFFFu); }); }},
      {17,
       "VlrCountOneTooMany",
       {"VLR 2 of 2"},
       [] {
         LasSpec s = with_vlr();
         s.vlrs[0].content.resize(100);
         return changed(s, [](Bytes& b) { store(&b[100], 2u); });
       }},
      {18,
       "VlrPastEnd",
       {":247:", "65535 bytes", "room for 10"},
       [] { return changed(with_vlr(), [](Bytes& b) { store(&b[227 + 20], std::uint16_t{65535}); }); }},
      {19,
       "EvlrStartWraps",
       {":235:", "18446744073709551600"},
       [] { return changed(with_evlr(), [](Bytes& b) { store(&b[235], std::uint64_t{0} - 16); }); }},
      {19,
       "EvlrCount",
       {"4294967295 EVLRs"},
       [] { return changed(with_evlr(), [](Bytes& b) { store(&b[243], 0xFFFF'FFFFu); }); }},
      {19,
       "EvlrLengthWraps",
       {"EVLR 1", "room for 10"},
       [] { return changed(with_evlr(), [](Bytes& b) { store(&b[b.size() - 50], ~std::uint64_t{0}); }); }},
      {19,
       "EvlrInPoints",
       {"EVLRs start at byte 376"},
       [] { return changed(with_evlr(), [](Bytes& b) { store(&b[235], std::uint64_t{376}); }); }},
      {24,
       "Truncated",
       {"found 2 whole records and a part of one"},
       [] { return changed({}, [](Bytes& b) { b.resize(b.size() - 1); }); }},
  };
  return kFiles;
}

// Accepted. What is not warned of is as good as the sound file.
inline const std::vector<Malformed>& odd_las_files() {
  static const std::vector<Malformed> kFiles = {
      {8,
       "Empty",
       {"no points"},
       [] {
         LasSpec s;
         s.xyz.clear();
         return las_bytes(s);
       }},
      {9,
       "LegacyCountDiffers",
       {"legacy point count is 2, the LAS 1.4 count 3"},
       [] { return changed(las_spec(4, 1), [](Bytes& b) { store(&b[107], 2u); }); }},
      {10,
       "LegacyCountOfFormat6",
       {"legacy point count is 3, expected 0"},
       [] { return changed(las_spec(4, 6), [](Bytes& b) { store(&b[107], 3u); }); }},
      {11,
       "LongestRecord",
       {},
       [] {
         LasSpec s;
         s.extra_bytes = 65'535 - 20;
         return las_bytes(s);
       }},
      {20, "BoxTurnedOver", {"bounding box"}, [] { return changed({}, [](Bytes& b) { store(&b[179], -2e3); }); }},
      {20, "BoxNan", {"bounding box"}, [] { return changed({}, [](Bytes& b) { store(&b[179], kNotANumber); }); }},
      {22, "GpsWeekAndStandardTime", {}, [] { return changed(las_spec(4, 6), [](Bytes& b) { b[6] ^= 1; }); }},
      // Nothing reads return numbers, and exports of photogrammetry have zeros throughout: a warning would warn nobody.
      {23,
       "ReturnsOfNone",
       {},
       [] {
         return changed({}, [](Bytes& b) {
           b[227 + 14] = 0;
           b[247 + 14] = 0x0F;
         });
       }},
      {25,
       "TrailingBytes",
       {"17 bytes behind the last point"},
       [] { return changed({}, [](Bytes& b) { b.resize(b.size() + 17); }); }},
      {26,
       "WildWaveforms",
       {},
       [] { return changed(las_spec(3, 4), [](Bytes& b) { store(&b[227], std::uint64_t{0xFFFF'FFFF'FFFF'FFF0}); }); }},
      {27,
       "WktOf60kB",
       {"WKT record cannot be understood"},
       [] {
         return las_bytes(with_crs({"LASF_Projection", 2112, Bytes(60'000, '[')}));
       }},
      {27,
       "WktWithoutEnd",
       {"WKT record cannot be understood"},
       [] {
         return las_bytes(with_crs({"LASF_Projection", 2112, text_bytes("PROJCS[\"x\"")}));
       }},
  };
  return kFiles;
}

}  // namespace btms::test
