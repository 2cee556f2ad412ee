// Where the columns of a text file are.
#pragma once

#include <optional>
#include <string>

#include "io/points/point_lines.h"

namespace btms {

struct XyzHeader {
  LineLayout lines;
  std::optional<std::size_t> class_column;
  std::optional<std::uint64_t> count;  // of the points, as the file says
};

// `columns` as PointFileOptions has it. Throws Error(kBadInput) when x, y or z can't be told, Error(kUsage) for bad
// `columns`.
XyzHeader read_xyz_header(const InputFile& file, const std::string& columns);

}  // namespace btms
