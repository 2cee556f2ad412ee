// Every way a PCD file can lie, and what we say to it.
#pragma once

#include "tests/io/points/malformed.h"
#include "tests/io/points/pcd_bytes.h"

namespace btms::test {

inline std::string replaced(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

// A sound ascii file of two points with one thing replaced.
inline Bytes ascii(const std::string& what, const std::string& by) {
  return replaced(pcd_header("ascii", 2) + "1 2 3\n4 5 6\n", what, by) + Bytes();
}

inline Bytes huge_ascii() {
  const std::string text = replaced(pcd_header("ascii", 2) + "1 2 3\n4 5 6\n", "WIDTH 2", "WIDTH 1000000000000000000");
  return replaced(text, "POINTS 2", "POINTS 1000000000000000000") + Bytes();
}

inline Bytes many_wide_fields() {
  std::string fields = "x y z", size = "4 4 4", type = "F F F", count = "1 1 1";
  for (int i = 0; i < 40; ++i) {
    fields += " f" + std::to_string(i);
    size += " 8";
    type += " F";
    count += " 65536";
  }
  return pcd_header("binary", 1, fields, size, type, count) + Bytes();
}

inline Bytes sizes(std::uint32_t packed, std::uint32_t unpacked, Bytes data) {
  Bytes bytes;
  bytes.reserve(8 + data.size());
  append(bytes, packed);
  append(bytes, unpacked);
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}

inline const std::vector<Malformed>& bad_pcd_files() {
  static const std::vector<Malformed> kFiles = {
      {29, "Empty", {"empty"}, [] { return Bytes(); }},
      {29, "NoDataLine", {"no DATA line"}, [] { return ascii("DATA ascii\n", ""); }},
      {29, "DataUnknown", {"line 11", "gzip"}, [] { return ascii("DATA ascii", "DATA gzip"); }},
      {29, "DataEndsFile", {"no DATA line"}, [] { return pcd_header("binary", 0).substr(0, 100) + Bytes(); }},
      {30, "PointsDiffer", {"line 10", "POINTS 3", "WIDTH 2 x HEIGHT 1"}, [] { return ascii("POINTS 2", "POINTS 3"); }},
      {31,
       "ProductOverflows",
       {"overflows"},
       [] {
         return replaced(replaced(pcd_header("binary", 2), "WIDTH 2", "WIDTH 9000000000000000000"), "HEIGHT 1",
                         "HEIGHT 9000000000000000000") +
                Bytes();
       }},
      {32, "WidthNegative", {"line 7", "-2"}, [] { return ascii("WIDTH 2", "WIDTH -2"); }},
      {32,
       "WidthHuge",
       {"1000000000000000000"},
       [] {
         return replaced(replaced(pcd_header("binary", 2), "WIDTH 2", "WIDTH 1000000000000000000"), "POINTS 2",
                         "POINTS 1000000000000000000") +
                Bytes(24);
       }},
      {32, "WidthHugeAscii", {"1000000000000000000 points", "found 2"}, [] { return huge_ascii(); }},
      {32, "WidthMissing", {"WIDTH with 0"}, [] { return ascii("WIDTH 2\n", ""); }},
      {32, "WidthFraction", {"2.5"}, [] { return ascii("WIDTH 2", "WIDTH 2.5"); }},
      {33, "Size3", {"line 4", "3 bytes"}, [] { return ascii("SIZE 4 4 4", "SIZE 4 4 3"); }},
      {33, "Size0", {"line 4", "found 0"}, [] { return ascii("SIZE 4 4 4", "SIZE 0 4 4"); }},
      {33, "Size16", {"line 4", "found 16"}, [] { return ascii("SIZE 4 4 4", "SIZE 4 16 4"); }},
      {33, "TypeX", {"line 5", "type X"}, [] { return ascii("TYPE F F F", "TYPE F X F"); }},
      {33, "FloatOf2", {"type F of 2"}, [] { return ascii("SIZE 4 4 4", "SIZE 4 4 2"); }},
      {34, "Count0", {"line 6", "found 0"}, [] { return ascii("COUNT 1 1 1", "COUNT 1 1 0"); }},
      {34, "CountHuge", {"line 6", "1000000000"}, [] { return ascii("COUNT 1 1 1", "COUNT 1 1 1000000000"); }},
      {34, "CountOfX", {"field x", "x 2"}, [] { return ascii("COUNT 1 1 1", "COUNT 2 1 1"); }},
      {35, "SizeMissing", {"SIZE has 0"}, [] { return ascii("SIZE 4 4 4\n", ""); }},
      {35,
       "SizeAndCountMissing",
       {"SIZE has 0"},
       [] { return ascii("SIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n", "TYPE F F F\n"); }},
      {35, "TypeAndCountMissing", {"TYPE has 0"}, [] { return ascii("TYPE F F F\nCOUNT 1 1 1\n", ""); }},
      {35,
       "SizeTypeAndCountMissing",
       {"SIZE has 0"},
       [] { return ascii("SIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n", ""); }},
      {35, "LengthsDiffer", {"TYPE has 2", "FIELDS 3"}, [] { return ascii("TYPE F F F", "TYPE F F"); }},
      {35, "CountsDiffer", {"COUNT has 4", "FIELDS 3"}, [] { return ascii("COUNT 1 1 1", "COUNT 1 1 1 1"); }},
      {36, "NoFields", {"no FIELDS"}, [] { return ascii("FIELDS x y z\n", ""); }},
      {36, "NoZ", {"field z found 0"}, [] { return ascii("FIELDS x y z", "FIELDS x y w"); }},
      {36,
       "XTwice",
       {"field x found 2"},
       [] { return pcd_header("ascii", 1, "x y z x", "4 4 4 4", "F F F F", "1 1 1 1") + Bytes(); }},
      {37,
       "XInt8",
       {"line 5", "field x is I8", "float32 or float64"},
       [] { return pcd_header("binary", 1, "x y z", "1 4 4", "I F F") + Bytes(9); }},
      {36, "KeywordTwice", {"POINTS a second time"}, [] { return ascii("DATA", "POINTS 2\nDATA"); }},
      {34, "RecordTooLong", {"16777216 bytes"}, [] { return many_wide_fields(); }},
      {39, "AsciiShort", {"declares 2 points", "found 1"}, [] { return ascii("4 5 6\n", ""); }},
      {39,
       "BinaryShort",
       {"declares 3 points of 12", "found 2 whole"},
       [] { return pcd_header("binary", 3) + Bytes(35); }},
      {38, "LongLine", {"line 13", "longer than 65536"}, [] { return ascii("4 5 6", std::string(100'000, '1')); }},
      {38,
       "LongLineNoNewline",
       {"longer than 65536"},
       [] { return pcd_header("ascii", 1) + std::string(1'000'000, ' ') + Bytes(); }},
      {29, "LongHeader", {"no DATA line"}, [] { return std::string(200'000, '#') + Bytes(); }},
      {40, "CompressedNoSizes", {"ends before"}, [] { return pcd_header("binary_compressed", 1) + Bytes(7); }},
      {40,
       "CompressedSizeLies",
       {"999 bytes", "found 14"},
       [] { return pcd_header("binary_compressed", 1) + sizes(999, 12, Bytes(14)); }},
      {40,
       "CompressedOutputLies",
       {"13 bytes when unpacked", "expected 12"},
       [] { return pcd_header("binary_compressed", 1) + sizes(14, 13, Bytes(14)); }},
      {40,
       "CompressedBomb",
       {"compressed data"},
       [] { return pcd_header("binary_compressed", 357'913'941) + sizes(12, 4'294'967'292, Bytes(12, 0x1F)); }},
      {40,
       "CompressedReference",
       {"before their start"},
       [] {
         return pcd_header("binary_compressed", 1) + sizes(3, 12, {0xE0, 3, 5});
       }},
      {40,
       "CompressedTooMany",
       {"declares 400000000 points"},
       [] { return pcd_header("binary_compressed", 400'000'000) + sizes(12, 505'032'704, Bytes(12)); }},
  };
  return kFiles;
}

// Found when the points are read.
inline const std::vector<Malformed>& unreadable_pcd_files() {
  static const std::vector<Malformed> kFiles = {
      {38, "Comma", {"line 13", "\"1,5\"", "for y"}, [] { return ascii("4 5 6", "4 1,5 6"); }},
      {38, "ShortLine", {"line 13", "found 2 numbers", "expected 3"}, [] { return ascii("4 5 6", "4 5"); }},
      {38, "LongLine", {"line 13", "found 4 numbers", "expected 3"}, [] { return ascii("4 5 6", "4 5 6 7"); }},
      {38, "Word", {"line 13", "\"zwei\""}, [] { return ascii("4 5 6", "4 zwei 6"); }},
  };
  return kFiles;
}

// Accepted, with a warning each.
inline const std::vector<Malformed>& odd_pcd_files() {
  static const std::vector<Malformed> kFiles = {
      {39,
       "TrailingLines",
       {"lines behind the last point"},
       [] { return pcd_header("ascii", 1) + "1 2 3\n4 5 6\n" + Bytes(); }},
      {39, "TrailingBytes", {"5 bytes behind"}, [] { return pcd_header("binary", 1) + Bytes(17); }},
      {40,
       "TrailingPackedBytes",
       {"2 bytes behind"},
       [] { return pcd_header("binary_compressed", 1) + compressed(Bytes(12), 2); }},
      {41,
       "ShortViewpoint",
       {"VIEWPOINT has 3"},
       [] { return replaced(pcd_header("ascii", 1) + "1 2 3\n", "0 0 0 1 0 0 0", "0 0 0") + Bytes(); }},
      {52, "NoPoints", {"no points"}, [] { return pcd_header("binary", 0) + Bytes(); }},
      {52, "NoLines", {"no points"}, [] { return pcd_header("ascii", 0) + Bytes(); }},
      {52, "NothingPacked", {"no points"}, [] { return pcd_header("binary_compressed", 0) + Bytes(8); }},
      {70,
       "FarFloats",
       {"lost their precision"},
       [] {
         Bytes far;
         for (const float v : {400000.5f, 1.0f, 2.0f}) append(far, v);
         return pcd_header("binary", 1) + far;
       }},
  };
  return kFiles;
}

}  // namespace btms::test
