#include "engine/lattice/lattice.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "engine/lattice/divider.h"
#include "engine/lattice/neighbours.h"
#include "engine/lattice/plane.h"
#include "engine/lattice/tiles.h"

namespace btms {
namespace {

// Origins that have broken lattices before: around zero, deep in the negative quadrant, UTM eastings and northings.
const std::vector<std::pair<std::int64_t, std::int64_t>> kOrigins = {
    {0, 0}, {-4'000, -4'000}, {-7'123'456'000, -48'000}, {352'000'000, 5'744'000'000}, {85'000'000, 446'000'000}};

// Area of a triangle twice, by its corners in half millimetres; positive inside for a point left of every edge.
bool inside_closed(const NodeId& n, std::int64_t r, std::int64_t x, std::int64_t y) {
  const auto corners = triangle_corners(n.triangle);
  const auto px = [&](int k) { return std::int64_t{n.cell.col} * r + corners[k].x * r / 2; };
  const auto py = [&](int k) { return std::int64_t{n.cell.row} * r + corners[k].y * r / 2; };
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3;
    if ((px(l) - px(k)) * (y - py(k)) - (py(l) - py(k)) * (x - px(k)) < 0) return false;
  }
  return true;
}

TEST(LatticeExhaustive, EveryPointIsInExactlyOneNodeAndInsideItsTriangle) {
  constexpr std::int64_t r = 8;  // smaller than the engine allows: all points of 5 x 5 cells in a blink
  const Lattice lattice(r);
  for (const auto& [ox, oy] : kOrigins) {
    std::map<NodeId, int> count;
    for (std::int64_t y = oy - 2 * r; y < oy + 3 * r; ++y)
      for (std::int64_t x = ox - 2 * r; x < ox + 3 * r; ++x) {
        const NodeId n = lattice.node_at(x, y);
        EXPECT_TRUE(inside_closed(n, r, x, y)) << x << ' ' << y;
        ++count[n];
      }
    ASSERT_EQ(count.size(), 5u * 5u * 4u);
    // Half-open cells: every cell has the same share of its border in every quadrant.
    for (const auto& [node, n] : count) EXPECT_EQ(n, count.at({lattice.cell_at(ox, oy), node.triangle}));
  }
}

TEST(LatticeExhaustive, EveryFineTriangleIsInExactlyOneCoarseTriangle) {
  constexpr std::int64_t r = 8;
  const Lattice coarse(2 * r), fine(r);
  std::map<NodeId, std::set<NodeId>> children;
  for (const auto& [ox, oy] : kOrigins)
    for (std::int64_t y = oy - 3 * r; y < oy + 5 * r; ++y)
      for (std::int64_t x = ox - 3 * r; x < ox + 5 * r; ++x) {
        const NodeId f = fine.node_at(x, y);
        EXPECT_EQ(parent(f), coarse.node_at(x, y))
            << "point on a diagonal or border changes parents: " << x << ' ' << y;
        children[parent(f)].insert(f);
      }
  int whole = 0;
  for (const auto& [node, set] : children) {
    EXPECT_LE(set.size(), 4u);
    whole += set.size() == 4;
  }
  EXPECT_GT(whole, 4 * 4 * static_cast<int>(kOrigins.size()) - 1);
}

TEST(Lattice, KeysAreUniqueAscendingAndInvertible) {
  std::vector<NodeId> nodes;
  for (const std::int32_t row : {-(1 << 30), -7, -1, 0, 1, 2'872'000, (1 << 30) - 1})
    for (const std::int32_t col : {-(1 << 30), -5, -1, 0, 3, 176'000, (1 << 30) - 1})
      for (std::uint8_t t = 0; t < kTriangles; ++t) nodes.push_back({{col, row}, t});
  NodeKey last = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const NodeKey key = node_key(nodes[i]);
    EXPECT_EQ(node_of_key(key), nodes[i]);
    if (i > 0) {
      EXPECT_GT(key, last);
    }
    last = key;
  }
}

TEST(Neighbours, AreFourteenSymmetricAndShareACorner) {
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    std::set<std::array<int, 3>> seen;
    for (const NodeOffset& o : kNeighbourTable[t]) {
      EXPECT_TRUE(seen.insert({o.col, o.row, o.triangle}).second) << "listed twice";
      EXPECT_FALSE(o.col == 0 && o.row == 0 && o.triangle == t) << "its own neighbour";
      const NodeOffset back{static_cast<std::int8_t>(-o.col), static_cast<std::int8_t>(-o.row), t};
      const auto& other = kNeighbourTable[o.triangle];
      EXPECT_NE(std::find(other.begin(), other.end(), back), other.end()) << "not symmetric";
    }
    EXPECT_EQ(seen.size(), 14u);
  }
}

TEST(Neighbours, IncidentTableListsEveryTriangleAroundACorner) {
  std::set<std::array<int, 3>> seen;
  for (const NodeOffset& o : kIncidentTable) {
    seen.insert({o.col, o.row, o.triangle});
    bool touches = false;
    for (const HalfCell& c : triangle_corners(o.triangle)) touches |= c.x + 2 * o.col == 0 && c.y + 2 * o.row == 0;
    EXPECT_TRUE(touches);
  }
  EXPECT_EQ(seen.size(), 8u);
}

TEST(Tiles, EveryCellIsInExactlyOneTile) {
  for (const std::int32_t edge : {1, 2, 7, 37})
    for (const Cell origin : {Cell{0, 0}, Cell{-5, 3}}) {
      const TileGrid grid{edge, origin};
      for (std::int32_t row = -80; row < 80; ++row)
        for (std::int32_t col = -80; col < 80; ++col) {
          EXPECT_TRUE(grid.box_of(grid.tile_of({col, row})).contains({col, row}));
        }
      std::int64_t cells = 0;
      const CellBox box{-41, -3, 50, 77};
      grid.for_each_tile(box, [&](TileId id) { cells += grid.box_of(id).intersect(box).cells(); });
      EXPECT_EQ(cells, box.cells());
    }
}

TEST(Tiles, BoxesOfCells) {
  const CellBox a{0, 0, 4, 2}, b{2, 1, 6, 5};
  EXPECT_EQ(a.intersect(b), (CellBox{2, 1, 4, 2}));
  EXPECT_EQ(a.hull(b), (CellBox{0, 0, 6, 5}));
  EXPECT_EQ(a.grown(2), (CellBox{-2, -2, 6, 4}));
  EXPECT_TRUE(a.intersect({4, 0, 5, 2}).empty());
  EXPECT_EQ(CellBox{}.hull(a), a);
}

TEST(Divider, EqualsDivision) {
  std::uint64_t state = 1;
  for (const std::uint32_t d : {1u, 2u, 3u, 7u, 100u, 2000u, 3200u, 64000u, 65534u, 1000003u, (1u << 28) - 1}) {
    const Divider divide(d);
    for (int i = 0; i < 20000; ++i) {
      state = state * 6364136223846793005u + 1442695040888963407u;
      const auto v = static_cast<std::uint32_t>(state >> 36);
      ASSERT_EQ(divide(v), v / d);
      const std::uint32_t edge = v / d * d;  // quotients change here
      ASSERT_EQ(divide(edge), edge / d);
      if (edge > 0) {
        ASSERT_EQ(divide(edge - 1), (edge - 1) / d);
      }
    }
    ASSERT_EQ(divide(Divider::kMaxOffset), Divider::kMaxOffset / d);
  }
}

TEST(FinalPlane, PassesThroughItsCorners) {
  constexpr std::int64_t r = 2000;
  const std::array<std::int32_t, 3> z = {1000, 1300, 700};
  for (std::uint8_t t = 0; t < kTriangles; ++t) {
    const FinalPlane plane = FinalPlane::through(t, z);
    const auto corners = triangle_corners(t);
    for (int k = 0; k < 3; ++k) {
      const std::int64_t dx = (corners[k].x - 1) * r / 2, dy = (corners[k].y - 1) * r / 2;
      EXPECT_EQ(plane.centre_mm * r + plane.rise_x_mm * dx + plane.rise_y_mm * dy, z[k] * r) << int{t} << ' ' << k;
    }
  }
}

}  // namespace
}  // namespace btms
