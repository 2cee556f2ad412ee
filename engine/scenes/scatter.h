// One random place in every cell of an endless lattice: how woods, bushes and boulders are spread.
#pragma once

#include <cmath>
#include <cstdint>

#include "engine/scenes/object.h"
#include "engine/scenes/random.h"

namespace btms {

// Calls f(x_m, y_m, random) for the cells within reach_m of the box, row by row; `random` is the cell's own.
template <typename F>
void scatter(std::uint64_t seed, double cell_m, const Box& box, double reach_m, F f) {
  const Box b = box.grown(reach_m);
  const auto cell = [&](double v) { return static_cast<std::int64_t>(std::floor(v / cell_m)); };
  for (std::int64_t j = cell(b.y0_m); j <= cell(b.y1_m); ++j)
    for (std::int64_t i = cell(b.x0_m); i <= cell(b.x1_m); ++i) {
      Random random(hash_at(seed, i, j));
      const double x = (static_cast<double>(i) + random.uniform()) * cell_m;
      const double y = (static_cast<double>(j) + random.uniform()) * cell_m;
      f(x, y, random);
    }
}

// An upright frame turned by a random angle.
inline Frame turned(double x_m, double y_m, Random& random) {
  // The rational parametrisation of the circle: no sine needed.
  const double t = random.uniform(-1, 1), n = 1 + t * t;
  const double c = (1 - t * t) / n, s = 2 * t / n;
  return {x_m, y_m, c, s, -s, c};
}

}  // namespace btms
