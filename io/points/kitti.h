// KITTI scans: float32 x, y, z, intensity in metres, no header.
#pragma once

#include <memory>

#include "io/points/point_file.h"

namespace btms {

// Besides the length, up to 3072 points are looked at: scans whose bytes are swapped are refused here.
std::unique_ptr<PointFile> open_kitti(const std::filesystem::path& path);

}  // namespace btms
