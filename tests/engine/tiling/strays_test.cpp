#include "engine/tiling/strays.h"

#include <gtest/gtest.h>

namespace btms {
namespace {

// Bins of 64 m.
const BinGrid kGrid(Lattice(2000), 32);
constexpr std::int32_t kKilometre = 16;  // in bins, a little more

OccupiedBin bin(std::int32_t km_east, std::int32_t km_north, std::uint64_t points) {
  return {{km_east * kKilometre, km_north * kKilometre}, points};
}

TEST(Strays, AreFewAndFarAway) {
  const Strays strays =
      find_strays(std::vector{bin(0, 0, 5'000), bin(1, 0, 5'000), bin(-50, 3, 4), bin(7000, 0, 5)}, kGrid);
  EXPECT_EQ(strays.points, 9u);
  EXPECT_EQ(strays.bins, (std::vector<BinId>{{7000 * kKilometre, 0}, {-50 * kKilometre, 3 * kKilometre}}));
}

TEST(Strays, AreNotManyAndNotNear) {
  EXPECT_EQ(find_strays(std::vector{bin(0, 0, 10'000), bin(50, 0, 10)}, kGrid).points, 0u) << "a thousandth";
  EXPECT_EQ(find_strays(std::vector{bin(0, 0, 10'000'000), bin(50, 0, 1'000)}, kGrid).points, 0u) << "a thousand";
  EXPECT_EQ(find_strays(std::vector{bin(0, 0, 10'000'000), bin(50, 0, 999)}, kGrid).points, 999u);
  EXPECT_EQ(find_strays(std::vector{bin(0, 0, 10'000), bin(9, 9, 1)}, kGrid).points, 0u) << "in the next square";
  EXPECT_EQ(find_strays(std::vector{bin(0, 0, 10'000), bin(-1, -1, 1)}, kGrid).points, 0u) << "across the corner";
  EXPECT_EQ(find_strays({}, kGrid).points, 0u);
  EXPECT_EQ(find_strays(std::vector{bin(3, 4, 1)}, kGrid).points, 0u);
}

TEST(Strays, AreCountedTogether) {
  // A line of few points that leads far away hangs on what it starts from.
  std::vector<OccupiedBin> road{bin(0, 0, 1'000'000)};
  for (std::int32_t km = 1; km < 100; km += 9) road.push_back(bin(km, 0, 1));
  EXPECT_EQ(find_strays(road, kGrid).points, 0u);
  // 20 lists of the same bin, as of 20 ranks, are one bin.
  std::vector<OccupiedBin> shares{bin(0, 0, 10'000)};
  shares.insert(shares.end(), 20, bin(50, 0, 1));
  EXPECT_EQ(find_strays(shares, kGrid).points, 0u);
}

}  // namespace
}  // namespace btms
