// What of a LAZ file is not compressed, as it stands in the LAS file of the same points.
#pragma once

#include <cstdint>
#include <vector>

#include "io/points/input_file.h"

namespace btms {

struct LazLayout {
  std::vector<std::uint8_t> head;  // header and VLRs, without what only LAZ and COPC have
  std::vector<std::uint8_t> tail;  // EVLRs, likewise
  std::uint64_t points = 0;
  std::uint16_t record_bytes = 0;

  std::uint64_t las_bytes() const { return head.size() + points * record_bytes + tail.size(); }
};

// Throws Error(kBadInput) when it is no LAZ file that can be read, is truncated, or has another number of points than
// its chunks. The numbers of the LAS header are for read_las_header() to judge.
LazLayout read_laz_layout(const InputFile& file);

}  // namespace btms
