// The header of a LAS file, checked against the file before anything is allocated or read by its numbers.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/points/input_file.h"

namespace btms {

inline constexpr std::uint8_t kLasFormats = 11;  // point formats 0..10
// Smallest record of each point format.
inline constexpr std::array<std::uint16_t, kLasFormats> kLasRecordBytes = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};

// Where a point format keeps its class. Formats 0-5 share the byte with three flags.
struct LasClassByte {
  std::size_t offset;
  std::uint8_t mask;
};
constexpr LasClassByte las_class_byte(std::uint8_t format) {
  return format < 6 ? LasClassByte{15, 0x1F} : LasClassByte{16, 0xFF};
}

// A variable length record (or an extended one): who wrote it, and where its content lies.
struct LasRecord {
  std::string user;
  std::uint16_t id = 0;
  std::uint64_t offset = 0, bytes = 0;
};

struct LasHeader {
  std::uint8_t minor_version = 0, format = 0;
  std::uint16_t header_bytes = 0, record_bytes = 0;
  std::uint64_t points_offset = 0, points = 0;
  std::array<double, 3> scale{}, offset{};  // file units
  std::optional<std::array<double, 6>>
      declared_bounds;             // min x, y, z, max x, y, z in file units, where they make sense
  std::vector<LasRecord> records;  // VLRs, then EVLRs
  std::vector<std::string> warnings;

  std::uint64_t points_end() const { return points_offset + points * record_bytes; }
};

// Throws Error(kBadInput) with the offset of the field that is wrong.
LasHeader read_las_header(const InputFile& file);

}  // namespace btms
