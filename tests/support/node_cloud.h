// The points of one node, for tests of what is worked out of them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "engine/terrain/node_model.h"

namespace btms::test {

struct NodeCloud {
  std::vector<std::int16_t> x, y;  // from the square's centre
  std::vector<std::int32_t> z;

  void add(std::int64_t px, std::int64_t py, std::int64_t pz) {
    x.push_back(static_cast<std::int16_t>(px));
    y.push_back(static_cast<std::int16_t>(py));
    z.push_back(static_cast<std::int32_t>(pz));
  }
  NodePoints points() const { return {x.data(), y.data(), z.data(), x.size()}; }
  NodeCloud reversed() const {
    NodeCloud back = *this;
    std::reverse(back.x.begin(), back.x.end());
    std::reverse(back.y.begin(), back.y.end());
    std::reverse(back.z.begin(), back.z.end());
    return back;
  }
};

}  // namespace btms::test
