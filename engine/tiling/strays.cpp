#include "engine/tiling/strays.h"

#include <algorithm>
#include <map>
#include <utility>

#include "engine/lattice/coordinates.h"

namespace btms {
namespace {

constexpr std::int64_t kSquare_mm = 10'000'000;
constexpr std::uint64_t kFewPoints = 1000, kSmallShare = 1000;

using Square = std::pair<std::int64_t, std::int64_t>;

struct Filling {
  std::uint64_t points = 0;
  std::size_t group = 0;  // 0: none yet
};

Square square_of(BinId bin, const BinGrid& grid) {
  return {floor_div(std::int64_t{bin.bx} * grid.edge_mm(), kSquare_mm),
          floor_div(std::int64_t{bin.by} * grid.edge_mm(), kSquare_mm)};
}

// Gives every square connected to `first` its group and returns their points.
std::uint64_t spread(Square first, std::size_t group, std::map<Square, Filling>& squares) {
  std::uint64_t points = 0;
  std::vector<Square> open{first};
  squares[first].group = group;
  while (!open.empty()) {
    const Square at = open.back();
    open.pop_back();
    points += squares[at].points;
    for (std::int64_t dx = -1; dx <= 1; ++dx)
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        const auto neighbour = squares.find({at.first + dx, at.second + dy});
        if (neighbour == squares.end() || neighbour->second.group != 0) continue;
        neighbour->second.group = group;
        open.push_back(neighbour->first);
      }
  }
  return points;
}

}  // namespace

Strays find_strays(std::span<const OccupiedBin> occupied, const BinGrid& grid) {
  std::map<Square, Filling> squares;
  for (const OccupiedBin& bin : occupied) squares[square_of(bin.id, grid)].points += bin.points;
  std::vector<std::uint64_t> points_in{0};  // by group
  for (auto& [square, filling] : squares)
    if (filling.group == 0) points_in.push_back(spread(square, points_in.size(), squares));
  const std::uint64_t most = *std::max_element(points_in.begin(), points_in.end());

  Strays strays;
  if (points_in.size() <= 2) return strays;
  const auto astray = [&](std::uint64_t points) { return points < kFewPoints && points < most / kSmallShare; };
  for (const OccupiedBin& bin : occupied) {
    if (!astray(points_in[squares[square_of(bin.id, grid)].group])) continue;
    strays.bins.push_back(bin.id);
    strays.points += bin.points;
  }
  std::sort(strays.bins.begin(), strays.bins.end());
  strays.bins.erase(std::unique(strays.bins.begin(), strays.bins.end()), strays.bins.end());
  return strays;
}

}  // namespace btms
