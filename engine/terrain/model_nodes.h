// The nodes of many points, taken four at a time with about as many points each, so that no lane idles.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/terrain/node_model.h"

namespace btms {

// Reusable memory of model_nodes().
struct ModelNodesScratch {
  std::vector<std::uint32_t> order;  // nodes with points, by size
  std::vector<std::uint32_t> begin;  // of a size class in `order`
  ModelScratch model;
};

// Eight classes an octave: 0, 1 .. 15, 16-17, 18-19 ..
inline std::size_t size_class(std::size_t points) {
  const auto bits = static_cast<std::size_t>(std::bit_width(points));
  return bits <= 4 ? points : 8 * (bits - 3) + (points >> (bits - 4) & 7);
}
inline constexpr std::size_t kSizeClasses = 8 * 62;

// Calls set(k, node) for every one of `nodes` nodes whose points_of(k) are not none.
template <class PointsOf, class Set>
void model_nodes(std::size_t nodes, const PointsOf& points_of, const NodeModelRules& rules, ModelNodesScratch& s,
                 const Set& set) {
  s.begin.assign(kSizeClasses + 1, 0);
  for (std::size_t k = 0; k < nodes; ++k) ++s.begin[size_class(points_of(k).size) + 1];
  const std::size_t empty = s.begin[1];
  for (std::size_t c = 0; c < kSizeClasses; ++c) s.begin[c + 1] += s.begin[c];
  s.order.resize(nodes);
  for (std::size_t k = 0; k < nodes; ++k)
    s.order[s.begin[size_class(points_of(k).size)]++] = static_cast<std::uint32_t>(k);

  for (std::size_t i = empty; i < nodes; i += 4) {
    const std::size_t n = std::min<std::size_t>(4, nodes - i);
    FourPoints points;
    for (std::size_t lane = 0; lane < n; ++lane) points[lane] = points_of(s.order[i + lane]);
    std::array<Node, 4> four;
    model_four(points, rules, s.model, four.data());
    for (std::size_t lane = 0; lane < n; ++lane) set(s.order[i + lane], four[lane]);
  }
}

}  // namespace btms
