// Label counts per file and in all, for `btms label` and `btms segment`.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/tiling/label.h"
#include "io/points/point_file.h"

namespace btms {

struct LabelReport {
  struct File {
    std::filesystem::path input, output;
    std::uint64_t points = 0;
    LabelCounts counts;
  };
  std::vector<File> files;
  std::vector<std::string> warnings;
  double seconds = 0;             // in all, file access included
  double mean_scan_seconds = -1;  // segment: model and labels of a scan, without file access

  void add(const PointFile& input, const std::filesystem::path& output, const LabelCounts& counts);
  void print(bool as_json) const;
};

}  // namespace btms
