// What `btms info` prints of a point file and of a map.
#pragma once

#include <string>

#include "engine/tiling/executor.h"
#include "io/points/point_file.h"

namespace btms {

void print_point_file(const std::string& path, const PointFileOptions& options, bool as_json);
void print_map(const std::string& path, bool untrusted, bool as_json, const Threads& threads);

}  // namespace btms
