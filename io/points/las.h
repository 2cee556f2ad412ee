// LAS 1.0 to 1.4, point formats 0 to 10, uncompressed.
#pragma once

#include <memory>

#include "io/points/point_file.h"

namespace btms {

std::unique_ptr<PointFile> open_las(const std::filesystem::path& path);
// A copy of the input in which only the class of labelled points differs.
std::unique_ptr<LabelWriter> create_las_labels(const PointFile& input, const std::filesystem::path& path);
std::vector<std::uint32_t> read_las_classes(const std::filesystem::path& path);

}  // namespace btms
