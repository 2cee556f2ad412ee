// Text files of points, one a line: .xyz, .csv, .txt, .asc as CloudCompare, PDAL and spreadsheets write them.
#pragma once

#include "io/points/point_file.h"

namespace btms {

// Columns are separated by blanks, tabs, commas or semicolons; lines that start with # or // are remarks. Which columns
// are x, y and z: as `columns` says, else as the names say in a line above the points (which may be a remark),
// else the first three. A number alone in a line above the points is their count, as CloudCompare writes it.
// Throws Error(kUsage) for `columns` that mean nothing.
std::unique_ptr<PointFile> open_xyz(const std::filesystem::path& path, const std::string& columns = {});

// Of the column called class, classification or label.
std::vector<std::uint32_t> read_xyz_classes(const std::filesystem::path& path);

}  // namespace btms
