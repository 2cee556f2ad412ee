// The text header of a PLY file, checked by itself.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "io/points/input_file.h"
#include "io/points/metres.h"

namespace btms {

enum class PlyData { kAscii, kLittleEndian, kBigEndian };

struct PlyProperty {
  std::string name;
  NumberType type = NumberType::kFloat32;  // of a list: of its entries
  std::optional<NumberType> list_count;    // lists: the type of their length
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::uint64_t line = 0;  // of the header
  std::vector<PlyProperty> properties;

  bool has_lists() const;
  std::uint64_t stride() const;  // bytes of one without lists; below 2^24
};

struct PlyHeader {
  PlyData data = PlyData::kAscii;
  std::vector<PlyElement> elements;
  std::size_t vertex = 0;  // index of the points among the elements; they have no lists, and x, y, z once each
  struct Axis {
    std::size_t column = 0;  // among the properties
    std::uint64_t offset = 0;
    NumberType type = NumberType::kFloat32;
  };
  std::array<Axis, 3> xyz;
  std::uint64_t data_offset = 0;
  std::uint64_t lines = 0;  // of the header

  const PlyElement& points() const { return elements[vertex]; }
};

// Throws Error(kBadInput) with the line number in the text.
PlyHeader read_ply_header(const InputFile& file);

}  // namespace btms
