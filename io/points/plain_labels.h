// Label files without a header, one number a point: SemanticKITTI's .label (u32) and .labels (u8).
#pragma once

#include <memory>

#include "io/points/point_file.h"

namespace btms {

// u32: 40 terrain, 99 obstacle and below, 0 dropped.
std::unique_ptr<LabelWriter> create_kitti_labels(const PointFile& input, const std::filesystem::path& path);
// u8: 1 terrain, 0 not.
std::unique_ptr<LabelWriter> create_byte_labels(const PointFile& input, const std::filesystem::path& path);

// The lower 16 bits: the upper ones are instance ids.
std::vector<std::uint32_t> read_kitti_classes(const std::filesystem::path& path);
std::vector<std::uint32_t> read_byte_classes(const std::filesystem::path& path);

}  // namespace btms
