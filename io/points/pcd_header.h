// The text header of a PCD file, checked against the file.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "io/points/input_file.h"

namespace btms {

enum class PcdData { kAscii, kBinary, kCompressed };

// x, y or z.
struct PcdField {
  std::size_t bytes = 0;     // 4 or 8: a float or a double
  std::uint64_t offset = 0;  // in a record
  std::size_t column = 0;    // index among the numbers of an ascii line
};

struct PcdHeader {
  std::string version;
  PcdData data = PcdData::kAscii;
  std::uint64_t points = 0;
  std::uint64_t stride = 0;  // bytes of a record, below 2^24
  std::size_t columns = 0;   // numbers of an ascii line
  std::uint64_t data_offset = 0;
  std::uint64_t data_line = 0;  // lines of the header, so line numbers of ascii data can be told
  std::array<PcdField, 3> xyz;
  std::vector<std::string> warnings;
};

// Throws Error(kBadInput) with the line number in the text.
PcdHeader read_pcd_header(const InputFile& file);

}  // namespace btms
