// Every way a PLY file can lie, and what we say to it.
#pragma once

#include "tests/io/points/malformed.h"
#include "tests/io/points/ply_bytes.h"

namespace btms::test {

// A sound ascii file of two points with one thing replaced.
inline Bytes ply_with(const std::string& what, const std::string& by) {
  std::string text = ply_header("ascii", 2) + "1 2 3\n4 5 6\n";
  return text.replace(text.find(what), what.size(), by) + Bytes();
}

inline const std::vector<Malformed>& bad_ply_files() {
  const auto faces = [](const std::string& count, const Bytes& data) {
    return ply_header("binary_little_endian", 1, "property float x\nproperty float y\nproperty float z\n",
                      "element face " + count + "\nproperty list uchar int vertex_indices\n") +
           data;
  };
  static const std::vector<Malformed> kFiles = {
      {43,
       "ListInVertex",
       {"line 4", "list (more)"},
       [] { return ply_with("property float z\n", "property float z\nproperty list uint float more\n"); }},
      {43,
       "ListTooLong",
       {"\"face\"", "truncated"},
       [] {
         return ply_header("binary_big_endian", 1, "property float x\nproperty float y\nproperty float z\n",
                           "element face 1\nproperty list int int vertex_indices\n") +
                Bytes(8, 0x7F);
       }},
      {43,
       "ListOfNegativeLength",
       {"negative length"},
       [] {
         return ply_header("binary_little_endian", 1, "property float x\nproperty float y\nproperty float z\n",
                           "element face 1\nproperty list char int vertex_indices\n") +
                Bytes(40, 0xFF);
       }},
      {43,
       "ListLengthFloat",
       {"line 6", "whole number"},
       [] { return ply_with("property float y", "property list float int y"); }},
      {45,
       "Count2To63",
       {"line 4", "9223372036854775808"},
       [] { return ply_with("vertex 2", "vertex 9223372036854775808"); }},
      {45,
       "CountHuge",
       {"9223372036854775807 points", "found 2"},
       [] { return ply_with("vertex 2", "vertex 9223372036854775807"); }},
      {45,
       "CountHugeBinary",
       {"header declares 9000000000000000000 points of 12 bytes, found 1"},
       [] { return ply_header("binary_little_endian", 9000000000000000000) + Bytes(12); }},
      {45, "CountNegative", {"line 4", "-2"}, [] { return ply_with("vertex 2", "vertex -2"); }},
      {45, "CountFraction", {"line 4", "2.5"}, [] { return ply_with("vertex 2", "vertex 2.5"); }},
      {46, "MoreFacesThanFile", {"100 of \"face\""}, [=] { return faces("100", Bytes(30)); }},
      {46, "FacesHuge", {"9000000000000000000 of \"face\""}, [=] { return faces("9000000000000000000", Bytes(30)); }},
      {47, "UnknownType", {"line 6", "type half"}, [] { return ply_with("property float y", "property half y"); }},
      {47, "UnknownFormat", {"line 2", "binary_little_endian"}, [] { return ply_with("format ascii", "format utf8"); }},
      {47, "UnknownVersion", {"line 2", "1.0"}, [] { return ply_with("ascii 1.0", "ascii 2.0"); }},
      {47, "UnknownKeyword", {"line 3", "remark"}, [] { return ply_with("comment", "remark"); }},
      {47, "NoFormat", {"no format"}, [] { return ply_with("format ascii 1.0\n", ""); }},
      {47,
       "PropertyOfNothing",
       {"line 3", "before the first element"},
       [] { return ply_with("comment made by hand", "property float x"); }},
      {47, "NoVertex", {"0 elements called vertex"}, [] { return ply_with("element vertex", "element point"); }},
      {47, "NoZ", {"line 4", "property z 0 times"}, [] { return ply_with("float z", "float height"); }},
      {47, "TwoX", {"line 4", "property x 2 times"}, [] { return ply_with("float y", "float x"); }},
      {48, "Empty", {"empty"}, [] { return Bytes(); }},
      {48, "NotPly", {"not a PLY file"}, [] { return text_bytes("solid x\n"); }},
      {48, "NoEndHeader", {"no end_header"}, [] { return ply_header("ascii", 2).substr(0, 60) + Bytes(); }},
      {48,
       "EndlessHeader",
       {"no end_header in the first 65536 bytes"},
       [] {
         std::string comments;
         for (int i = 0; i < 10'000; ++i) comments += "comment more\n";
         return ply_with("comment made by hand\n", comments);
       }},
      {49,
       "LongComment",
       {"line 3", "longer than 4096"},
       [] { return ply_with("made by hand", std::string(200'000, 'x')); }},
      {50, "FewerLines", {"declares 2 points, found 1 lines"}, [] { return ply_with("4 5 6\n", ""); }},
      {50,
       "FewerRecords",
       {"declares 3 points of 12 bytes, found 2"},
       [] { return ply_header("binary_big_endian", 3) + Bytes(35); }},
  };
  return kFiles;
}

// Accepted at opening: only who reads the numbers sees them.
inline const std::vector<Malformed>& unreadable_ply_files() {
  static const std::vector<Malformed> kFiles = {
      {50, "NumberWithComma", {"line 9", "\"1,5\"", "for x"}, [] { return ply_with("1 2 3", "1,5 2 3"); }},
      {50, "ShortLine", {"line 10", "found 2 numbers"}, [] { return ply_with("4 5 6", "4 5"); }},
  };
  return kFiles;
}

inline const std::vector<Malformed>& odd_ply_files() {
  static const std::vector<Malformed> kFiles = {
      {50, "MoreLines", {"lines behind the last point"}, [] { return ply_with("4 5 6\n", "4 5 6\n7 8 9\n"); }},
      {50,
       "MoreBytes",
       {"5 bytes behind the last point"},
       [] { return ply_header("binary_little_endian", 1) + Bytes(17); }},
      {50, "NoPoints", {"no points"}, [] { return ply_header("binary_little_endian", 0) + Bytes(); }},
  };
  return kFiles;
}

}  // namespace btms::test
