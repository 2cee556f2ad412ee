// The points of one bin sorted by node: a counting sort in reused memory, one object a worker.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/terrain/node_model.h"
#include "engine/tiling/point_bins.h"

namespace btms {

class NodeSort {
 public:
  // Precondition: less than 2^32 points. Throws Error(kBadInput) for more than kMaxNodePoints in one node.
  void sort(const PointBins::Bin& bin, const BinGrid& grid);

  // Points of node (row b + col) 4 + triangle of the bin, in no particular order.
  NodePoints node(std::size_t k) const {
    const std::uint32_t begin = k == 0 ? 0 : end_[k - 1];
    return {x_.data() + begin, y_.data() + begin, z_.data() + begin, end_[k] - begin};
  }

 private:
  std::vector<std::uint16_t> key_;
  std::vector<std::uint32_t> end_;   // per node: where its points end
  std::vector<std::int16_t> x_, y_;  // from the square's centre
  std::vector<std::int32_t> z_;
};

}  // namespace btms
