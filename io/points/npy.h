// NumPy arrays (.npy) of shape (N, 3 or more), float32 or float64, C order: a row is a point, x, y, z its first
// numbers.
#pragma once

#include <memory>

#include "io/points/point_file.h"

namespace btms {

std::unique_ptr<PointFile> open_npy(const std::filesystem::path& path);

}  // namespace btms
