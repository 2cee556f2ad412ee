// From numbers in metres, of any type, to the millimetres of a block: what PCD, PLY, NPY and text files share.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/tiling/millimetres.h"
#include "io/points/point_file.h"
#include "io/points/point_lines.h"

namespace btms {

enum class NumberType : std::uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

constexpr std::size_t bytes_of(NumberType type) {
  constexpr std::size_t kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<std::size_t>(type)];
}
constexpr NumberType float_of(std::size_t bytes) { return bytes == 4 ? NumberType::kFloat32 : NumberType::kFloat64; }

// Metres, one axis after the other. A float is exact in double and so is 1000 times it; a double loses at most 1e-5 mm.
struct Metres {
  double axis[3][kMmChunk];

  // n <= kMmChunk numbers that are `stride` bytes apart.
  void unpack(std::size_t to, const std::uint8_t* from, std::size_t stride, NumberType type, std::size_t n,
              bool big_endian = false);
  void round(std::size_t n, PointBlock& block, std::size_t at) const {
    round_into<double>({{axis[0], 1000, 0}, {axis[1], 1000, 0}, {axis[2], 1000, 0}}, n, block, at);
  }
};

// Points [first, first + count) of a text file into `block`, which was reset to count.
void read_lines(const PointLines& lines, const InputFile& file, std::uint64_t first, std::size_t count,
                PointBlock& block);

// float32 has steps of 8 mm beyond 10^5 m, of 0.5 m at a northing of 5 * 10^6 m: warns when the first points are there.
void warn_of_coarse_floats(const PointFile& file, std::vector<std::string>& warnings);

}  // namespace btms
