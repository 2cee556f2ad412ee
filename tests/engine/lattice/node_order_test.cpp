#include "engine/lattice/node_order.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace btms {
namespace {

TEST(NodeOrder, TheNodesOfEveryCoarserNodeAreContiguous) {
  const NodeOrder order(4);
  EXPECT_EQ(order.finest_nodes(), 1024u);
  for (int depth = 0; depth <= 4; ++depth) {
    const auto& numbers = order.numbers(depth);
    const std::int32_t edge = 1 << depth;
    ASSERT_EQ(numbers.size(), static_cast<std::size_t>(4 * edge * edge));
    auto sorted = numbers;
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t k = 0; k < sorted.size(); ++k) ASSERT_EQ(sorted[k], k) << "every number once";
    if (depth == 0) continue;
    std::size_t at = 0;
    for (std::int32_t row = 0; row < edge; ++row)
      for (std::int32_t col = 0; col < edge; ++col)
        for (std::uint8_t t = 0; t < kTriangles; ++t) {
          const NodeId above = parent({{col, row}, t});
          const auto k =
              static_cast<std::size_t>((above.cell.row * (edge / 2) + above.cell.col) * kTriangles + above.triangle);
          EXPECT_EQ(numbers[at++] / 4, order.numbers(depth - 1)[k]);
        }
  }
}

}  // namespace
}  // namespace btms
