// Random access to the lines of an ascii PCD file.
#pragma once

#include <functional>
#include <vector>

#include "io/points/pcd_header.h"

namespace btms {

// Remembers where every 1024th data line starts. Blank lines don't count. Immutable, thread-safe.
class PcdLines {
 public:
  // Throws Error(kBadInput) when there are fewer lines than points, or one is too long.
  PcdLines(const InputFile& file, const PcdHeader& header);

  bool trailing() const { return trailing_; }  // lines behind the last point

  // Calls visit(x, y, z in metres) for points [first, first + count) in order.
  void read(const InputFile& file, const PcdHeader& header, std::uint64_t first, std::size_t count,
            std::vector<std::uint8_t>& scratch, const std::function<void(const double*)>& visit) const;

 private:
  struct Mark {
    std::uint64_t offset, line;  // in the file, the line counted from 1
  };
  std::vector<Mark> marks_;  // of points 0, 1024, ..., and the end
  bool trailing_ = false;
};

}  // namespace btms
