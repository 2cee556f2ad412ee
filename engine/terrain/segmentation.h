// Point labels (paper Eq 14).
#pragma once

#include <cstdint>

namespace btms {

enum class Label : std::uint8_t {
  kDropped = 0,   // not a finite point in range: takes no part, keeps its place in the order
  kTerrain = 1,   // p . s + d <= eps3
  kObstacle = 2,  // above the surface, or over a node without a final plane
  kBelow = 3,     // further below the surface than below_m: multipath, wells, sensor noise
};

}  // namespace btms
