// btms::ScanSegmenter for code that is not C++20, as ROS 1 messages are not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "robotics/point_cloud2.h"

namespace btms {

// Not thread-safe. Errors are std::runtime_error.
class ScanLabeller {
 public:
  explicit ScanLabeller(const std::string& preset);  // a name that `btms params` knows
  ~ScanLabeller();
  // One number for each point: 0 dropped, 1 terrain, 2 obstacle, 3 below.
  const std::vector<std::uint8_t>& labels_of(const Columns& points);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace btms
