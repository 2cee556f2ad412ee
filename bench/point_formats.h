// Writers for the formats that only the readers' benchmark needs. Coordinates become float32 metres.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "engine/tiling/point_source.h"

namespace btms::bench {

void write_kitti(const std::filesystem::path& path, const PointBlock& points);
enum class PcdKind { kAscii, kBinary, kCompressed };
void write_pcd(const std::filesystem::path& path, const PointBlock& points, PcdKind kind);

// Greedy LZF, as common writers do it.
std::vector<std::uint8_t> lzf_compress(std::span<const std::uint8_t> input);

}  // namespace btms::bench
