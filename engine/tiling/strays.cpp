#include "engine/tiling/strays.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "engine/lattice/coordinates.h"

namespace btms {
namespace {

constexpr std::int64_t kSquare_mm = 10'000'000;
constexpr std::uint64_t kFewPoints = 1000, kSmallShare = 1000;

struct Square {
  std::int32_t x = 0, y = 0;
  std::uint64_t points = 0;
  friend bool operator<(const Square& a, const Square& b) { return std::tie(a.y, a.x) < std::tie(b.y, b.x); }
};

Square square_of(BinId bin, const BinGrid& grid) {
  const auto index = [&](std::int32_t b) {
    return static_cast<std::int32_t>(floor_div(std::int64_t{b} * grid.edge_mm(), kSquare_mm));
  };
  return {index(bin.bx), index(bin.by), 0};
}

bool same_place(const Square& a, const Square& b) { return a.x == b.x && a.y == b.y; }

// Squares with points, ascending.
std::vector<Square> squares_of(std::span<const OccupiedBin> occupied, const BinGrid& grid) {
  std::vector<Square> squares;
  for (const OccupiedBin& bin : occupied) {
    const Square square = square_of(bin.id, grid);
    if (squares.empty() || !same_place(squares.back(), square)) squares.push_back(square);
    squares.back().points += bin.points;
  }
  std::sort(squares.begin(), squares.end());
  std::size_t last = 0;
  for (std::size_t i = 1; i < squares.size(); ++i) {
    if (same_place(squares[last], squares[i]))
      squares[last].points += squares[i].points;
    else
      squares[++last] = squares[i];
  }
  if (!squares.empty()) squares.resize(last + 1);
  return squares;
}

// Of every square the points of its whole group: squares that touch, also at a corner.
std::vector<std::uint64_t> points_of_groups(const std::vector<Square>& squares) {
  std::vector<std::size_t> parent(squares.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (std::size_t i = 0; i < squares.size(); ++i) {
    const auto [x, y, points] = squares[i];
    // The neighbours that come later: in the east, and three in the row above.
    if (i + 1 < squares.size() && same_place(squares[i + 1], {x + 1, y})) parent[root(i + 1)] = root(i);
    const auto above = std::lower_bound(squares.begin(), squares.end(), Square{x - 1, y + 1});
    for (auto it = above; it != squares.end() && it->y == y + 1 && it->x <= x + 1; ++it)
      parent[root(static_cast<std::size_t>(it - squares.begin()))] = root(i);
  }
  std::vector<std::uint64_t> points(squares.size());
  for (std::size_t i = 0; i < squares.size(); ++i) points[root(i)] += squares[i].points;
  for (std::size_t i = 0; i < squares.size(); ++i) points[i] = points[root(i)];
  return points;
}

}  // namespace

Strays find_strays(std::span<const OccupiedBin> occupied, const BinGrid& grid) {
  const std::vector<Square> squares = squares_of(occupied, grid);
  const std::vector<std::uint64_t> points = points_of_groups(squares);
  Strays strays;
  if (squares.size() < 2) return strays;
  const std::uint64_t most = *std::max_element(points.begin(), points.end());
  std::vector<Square> astray;
  for (std::size_t i = 0; i < squares.size(); ++i)
    if (points[i] < kFewPoints && points[i] < most / kSmallShare) astray.push_back(squares[i]);
  if (astray.empty()) return strays;
  for (const OccupiedBin& bin : occupied) {
    if (!std::binary_search(astray.begin(), astray.end(), square_of(bin.id, grid))) continue;
    strays.bins.push_back(bin.id);
    strays.points += bin.points;
  }
  std::sort(strays.bins.begin(), strays.bins.end());
  strays.bins.erase(std::unique(strays.bins.begin(), strays.bins.end()), strays.bins.end());
  return strays;
}

}  // namespace btms
