// PLY: ascii, and binary of both byte orders. Points are the element "vertex".
#pragma once

#include <memory>

#include "io/points/point_file.h"

namespace btms {

std::unique_ptr<PointFile> open_ply(const std::filesystem::path& path);

}  // namespace btms
