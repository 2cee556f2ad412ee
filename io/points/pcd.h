// PCD 0.6 and 0.7: ascii, binary and binary_compressed; x, y, z as float32 or float64, any other fields skipped.
#pragma once

#include <memory>

#include "io/points/point_file.h"

namespace btms {

// Goes once through an ascii or compressed file, to find its lines or to check its compression.
std::unique_ptr<PointFile> open_pcd(const std::filesystem::path& path);

}  // namespace btms
