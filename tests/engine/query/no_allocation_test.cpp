// Queries of tiles in the cache take no memory: counted by this program's operator new.
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <new>

#include "engine/query/footprint.h"
#include "tests/engine/query/query_map.h"

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // those have their own

namespace {
thread_local std::size_t allocations = 0;
}

#pragma GCC diagnostic ignored "-Wmismatched-new-delete"  // it sees through one of the pair only
void* operator new(std::size_t bytes) {
  ++allocations;
  if (void* memory = std::malloc(bytes)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace btms {
namespace {

TEST(NoAllocation, InWarmTiles) {
  const Terrain terrain(std::make_shared<const MemoryMap>(test::rolling_map(3)));
  VehicleLimits limits;  // that nothing exceeds: checks go all the way
  limits.slope_deg = 90;
  limits.step_m = 10;
  limits.unknown_is_safe = true;
  const std::array<Place, 4> body = {Place{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  const std::array<Place, 3> path = {Place{10, 10}, {40, 50}, {50, 50}};
  std::array<HeightAnswer, 3> answers;
  std::size_t counted[2];
  for (int round = 0; round < 2; ++round) {  // the first one loads the tiles
    const std::size_t before = allocations;
    terrain.heights(path, answers);
    for (const Place p : path) {
      answers[0] = terrain.height(p, 1);
      EXPECT_TRUE(check_disc(terrain, p, 3, limits).safe);
      EXPECT_TRUE(check_pose(terrain, {p, 0.3}, body, limits).safe);
    }
    EXPECT_TRUE(check_polygon(terrain, path, limits).safe);
    EXPECT_TRUE(check_path(terrain, path, body, limits).safe);
    EXPECT_TRUE(check_path(terrain, path, 0.5, limits).safe);
    counted[round] = allocations - before;
  }
  EXPECT_GT(counted[0], 0u);
  EXPECT_EQ(counted[1], 0u);
}

}  // namespace
}  // namespace btms

#endif
