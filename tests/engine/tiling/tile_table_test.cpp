#include "engine/tiling/tile_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

namespace btms {
namespace {

constexpr std::int32_t kSide = 32, kTileCells = 64;  // blocks of one tile, bins of a tile each

// A town of kSide x kSide tiles, ten times as many points in its south-west quarter.
std::vector<OccupiedBin> town() {
  std::vector<OccupiedBin> bins;
  for (std::int32_t by = -kSide / 2; by < kSide / 2; ++by)
    for (std::int32_t bx = -kSide / 2; bx < kSide / 2; ++bx)
      bins.push_back({{bx, by}, bx < 0 && by < 0 ? 100'000'000u : 10'000'000u});
  return bins;
}

TileTable table_of(const std::vector<OccupiedBin>& bins) {
  std::vector<BinId> ids;
  for (const OccupiedBin& bin : bins) ids.push_back(bin.id);
  return TileTable(ids, BinGrid(Lattice(1000), kTileCells), kTileCells, 0, std::uint64_t{1} << 40);
}

TEST(TileTable, RanksHaveEqualWork) {
  const std::vector<OccupiedBin> bins = town();
  TileTable table = table_of(bins);
  for (const int ranks : {1, 2, 3, 5, 8, 64}) {
    table.share_out(bins, ranks);
    std::map<int, double> points;
    double all = 0;
    for (const OccupiedBin& bin : bins) {
      points[table.owner_of(bin.id)] += static_cast<double>(bin.points);
      all += static_cast<double>(bin.points);
    }
    ASSERT_EQ(points.size(), static_cast<std::size_t>(ranks));
    EXPECT_EQ(points.begin()->first, 0);
    for (const auto& [rank, mine] : points) EXPECT_NEAR(mine, all / ranks, 100'000'000 + 0.03 * all / ranks) << rank;
  }
}

TEST(TileTable, ARankOwnsOnePlaceWithAShortBorder) {
  const std::vector<OccupiedBin> bins = town();
  TileTable table = table_of(bins);
  for (const int ranks : {2, 3, 5, 8}) {
    table.share_out(bins, ranks);
    std::map<TileId, int> owner;
    for (const Tile& tile : table.tiles()) owner[tile.id] = tile.owner;
    std::set<TileId> unseen;
    for (const auto& [id, rank] : owner) unseen.insert(id);
    int places = 0, border = 0;
    while (!unseen.empty()) {
      ++places;
      std::vector<TileId> front{*unseen.begin()};
      unseen.erase(unseen.begin());
      while (!front.empty()) {
        const TileId at = front.back();
        front.pop_back();
        for (const TileId next :
             {TileId{at.tx + 1, at.ty}, TileId{at.tx - 1, at.ty}, TileId{at.tx, at.ty + 1}, TileId{at.tx, at.ty - 1}}) {
          if (!owner.contains(next)) continue;
          if (owner[next] != owner[at])
            ++border;
          else if (unseen.erase(next))
            front.push_back(next);
        }
      }
    }
    EXPECT_EQ(places, ranks);                  // what follows a Hilbert curve hangs together
    EXPECT_LE(border, 2 * ranks * 2 * kSide);  // diagonals: about 2 * 2 * kSide * kSide
  }
}

TEST(TileTable, OwnersAreTheSameForAnyOrder) {
  std::vector<OccupiedBin> bins = town();
  TileTable table = table_of(bins), shuffled = table;
  table.share_out(bins, 7);
  std::ranges::reverse(bins);
  bins.back().points -= 500;  // a bin of two ranks
  bins.push_back({bins.back().id, 500});
  shuffled.share_out(bins, 7);
  for (std::size_t i = 0; i < table.tiles().size(); ++i) EXPECT_EQ(table.tiles()[i].owner, shuffled.tiles()[i].owner);
}

TEST(TileTable, MoreRanksThanTiles) {
  const std::vector<OccupiedBin> bins{{{0, 0}, 5}, {{1, 0}, 5}};
  TileTable table = table_of(bins);
  table.share_out(bins, 9);
  EXPECT_NE(table.tiles()[0].owner, table.tiles()[1].owner);
  for (const Tile& tile : table.tiles()) EXPECT_LT(tile.owner, 9);
}

}  // namespace
}  // namespace btms
