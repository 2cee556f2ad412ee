// LAS 1.0 to 1.4, point formats 0 to 10, uncompressed.
#pragma once

#include <memory>

#include "io/points/point_file.h"

namespace btms {

// Points come out in `crs` where that is not empty and the file's own is another; degrees and geocentric coordinates in
// the UTM zone of the middle of the header's box where it is empty.
std::unique_ptr<PointFile> open_las(const std::filesystem::path& path, const std::string& crs = {});
// A copy of the input in which only the class of labelled points differs.
std::unique_ptr<LabelWriter> create_las_labels(const PointFile& input, const std::filesystem::path& path);
std::vector<std::uint32_t> read_las_classes(const std::filesystem::path& path);

}  // namespace btms
