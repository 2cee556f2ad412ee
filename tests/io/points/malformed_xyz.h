// Every way a text file of points can be unlike one, and what we say to it.
#pragma once

#include "tests/io/points/malformed.h"

namespace btms::test {

inline Bytes bytes_of_text(const std::string& text) { return {text.begin(), text.end()}; }

inline const std::vector<Malformed>& bad_xyz_files() {
  static const std::vector<Malformed> kFiles = {
      {75, "TwoColumns", {"line 1", "2 columns", "expected x y z"}, [] { return bytes_of_text("1 2\n3 4\n"); }},
      {75, "NoZ", {"line 2", "\"x y h2\"", "--columns"}, [] { return bytes_of_text("# a\nx y h2\n1 2 3\n"); }},
      {75, "XTwice", {"x twice", "--columns"}, [] { return bytes_of_text("x,y,z,X\n1,2,3,4\n"); }},
      {75, "NamesForOthers", {"line 2", "3 columns", "names for 4"}, [] { return bytes_of_text("x,y,z,i\n1,2,3\n"); }},
      {75, "EsriGrid", {"line 1", "2 columns"}, [] { return bytes_of_text("ncols 4\nnrows 4\nxll 0\n1 2 3 4\n"); }},
      {76, "DecimalCommas", {"line 1", "\"1,5\"", "point"}, [] { return bytes_of_text("1,5;2,5;3,5\n"); }},
      {76, "DecimalCommasBlanks", {"line 1", "\"5 2\"", "point"}, [] { return bytes_of_text("1,5 2,5 3,5\n"); }},
      {76, "Words", {"line 2", "expected numbers"}, [] { return bytes_of_text("x y z\nand so on\n"); }},
      {77, "LongFirstLine", {"line 1", "65536"}, [] { return bytes_of_text(std::string(70'000, '1')); }},
      {77,
       "NoNumbers",
       {"no line of numbers"},
       [] {
         std::string text;
         for (int i = 0; i < 40'000; ++i) text += "# remark\n";
         return bytes_of_text(text);
       }},
      {77, "Binary", {"no text"}, [] { return Bytes(64); }},
  };
  return kFiles;
}

// Found when the points are read.
inline const std::vector<Malformed>& unreadable_xyz_files() {
  static const std::vector<Malformed> kFiles = {
      {76, "NoNumber", {"line 3", "\"seven\"", "for y"}, [] { return bytes_of_text("x,y,z\n1,2,3\n4,seven,6\n"); }},
      {76, "EmptyField", {"line 2", "\"\"", "for z"}, [] { return bytes_of_text("1,2,3,9\n4,5,,9\n"); }},
      {76, "ShortLine", {"line 2", "found 2", "expected 3"}, [] { return bytes_of_text("1 2 3\n4 5\n7 8 9\n"); }},
      {76, "LongLine", {"line 2", "found 4", "expected 3"}, [] { return bytes_of_text("1 2 3\n4 5 6 7\n"); }},
  };
  return kFiles;
}

inline const std::vector<Malformed>& odd_xyz_files() {
  static const std::vector<Malformed> kFiles = {
      {78, "Empty", {"no points"}, [] { return Bytes(); }},
      {78, "OnlyNames", {"no points"}, [] { return bytes_of_text("//X Y Z\n"); }},
      {78, "AnotherCount", {"says it has 7 points, found 2"}, [] { return bytes_of_text("7\n1 2 3\n4 5 6\n"); }},
      {78, "Windows", {}, [] { return bytes_of_text("\xEF\xBB\xBFX;Y;Z\r\n1;2;3\r\n4;5;6\r\n"); }},
  };
  return kFiles;
}

}  // namespace btms::test
