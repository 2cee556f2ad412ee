// LAZ and COPC (LAS 1.0 to 1.4, point formats 0 to 3 and 6 to 10, compressed in chunks).
//
// Decompressed by a program of its own (laz_child.h) into a temporary LAS file without a name, in TMPDIR or /tmp, when
// the first point is wanted; from there on it is a LAS file. The last few such files are kept.
#pragma once

#include <memory>

#include "io/points/point_file.h"

namespace btms {

std::unique_ptr<PointFile> open_laz(const std::filesystem::path& path, const std::string& crs = {});  // as open_las()
// A LAS file: header, records and points of the input, in its order, with the class of labelled points changed.
std::unique_ptr<LabelWriter> create_laz_labels(const PointFile& input, const std::filesystem::path& path);
std::vector<std::uint32_t> read_laz_classes(const std::filesystem::path& path);

}  // namespace btms
