// Tiles of a map within a budget, and readers beside the evictor.
#include "engine/query/tile_cache.h"

#include <gtest/gtest.h>

#include <thread>

#include "tests/engine/query/query_map.h"

namespace btms {
namespace {

using test::CountingMap;
using test::rolling_map;

TEST(TileCache, LoadsATileOnce) {
  const MemoryMap map = rolling_map(3);
  const auto source = std::make_shared<CountingMap>(map);
  const TileCache cache(source, 1 << 30);
  for (int round = 0; round < 3; ++round)
    for (const TileId id : map.tiles()) {
      EXPECT_EQ(cache.pin(id)->box, map.load(id)->box);
      EXPECT_EQ(cache.load(id)->nodes, map.load(id)->nodes);
    }
  EXPECT_EQ(source->loads, 9);
  EXPECT_EQ(cache.counts().loads, 9u);
  EXPECT_EQ(cache.counts().evictions, 0u);
  EXPECT_FALSE(cache.pin({7, 7}));
  EXPECT_EQ(cache.load({7, 7}), nullptr);
  EXPECT_TRUE(cache.contains({2, 2}));
  EXPECT_FALSE(cache.contains({-1, 0}));
}

TEST(TileCache, KeepsWithinItsBudget) {
  const MemoryMap map = rolling_map(4);
  const std::size_t one = memory_bytes(*map.load({0, 0}));
  const auto source = std::make_shared<CountingMap>(map);
  const TileCache cache(source, 5 * one);
  for (const TileId id : map.tiles()) {
    cache.pin(id);
    EXPECT_LE(cache.counts().bytes, 6 * one);
    cache.pin({0, 0});  // used all the time: stays
  }
  EXPECT_GT(cache.counts().evictions, 0u);
  const int before = source->loads;
  cache.pin({0, 0});
  EXPECT_EQ(source->loads, before);
}

TEST(TileCache, KeepsOneTileWhateverTheBudget) {
  const MemoryMap map = rolling_map(2);
  const TileCache cache(std::make_shared<CountingMap>(map), 1);
  for (const TileId id : map.tiles()) EXPECT_EQ(cache.pin(id)->box, map.load(id)->box);
  EXPECT_EQ(cache.counts().evictions, 3u);
}

TEST(TileCache, AnEvictedTileLivesWhileItIsPinned) {
  const MemoryMap map = rolling_map(3);
  const TileCache cache(std::make_shared<CountingMap>(map), 1);
  const TileCache::Pin pin = cache.pin({1, 1});
  const std::shared_ptr<const TerrainTile> shared = cache.load({2, 0});
  for (const TileId id : map.tiles()) cache.pin(id);
  EXPECT_EQ(pin->nodes, map.load({1, 1})->nodes);
  EXPECT_EQ(shared->nodes, map.load({2, 0})->nodes);
}

TEST(TileCache, AnEvictedTileThatIsPinnedComesBackWithoutALoad) {
  const MemoryMap map = rolling_map(2);
  const auto source = std::make_shared<CountingMap>(map);
  const TileCache cache(source, 1);
  const TileCache::Pin pin = cache.pin({1, 1});
  cache.pin({0, 0});
  EXPECT_EQ(cache.counts().evictions, 1u);
  EXPECT_EQ(cache.pin({1, 1}).get(), pin.get());
  EXPECT_EQ(source->loads, 2);
  EXPECT_EQ(cache.counts().bytes, memory_bytes(*pin));
}

// Whoever comes while a tile is being read waits for it.
TEST(TileCache, ThreadsThatAskTogetherLoadOnce) {
  const MemoryMap map = rolling_map(3);
  const auto source = std::make_shared<CountingMap>(map);
  source->slow = true;
  const TileCache cache(source);
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t)
    threads.emplace_back([&] {
      for (const TileId id : map.tiles()) EXPECT_TRUE(cache.pin(id));
    });
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(source->loads, 9);
}

TEST(TileCache, TryingTellsDamagedFromAbsent) {
  const MemoryMap map = rolling_map(2);
  const auto source = std::make_shared<CountingMap>(map);
  const TileCache cache(source);
  source->refuse = true;
  for (int round = 0; round < 2; ++round) {
    EXPECT_FALSE(cache.try_pin({1, 1}));
    EXPECT_TRUE(cache.try_pin({1, 1}).damaged());
  }
  EXPECT_EQ(source->loads, 1);
  EXPECT_FALSE(cache.try_pin({5, 5}));
  EXPECT_FALSE(cache.try_pin({5, 5}).damaged());
  EXPECT_TRUE(cache.try_pin({0, 1}));
}

TEST(TileCache, ADamagedTileIsTriedAgainByLoadOnly) {
  const MemoryMap map = rolling_map(2);
  const auto source = std::make_shared<CountingMap>(map);
  const TileCache cache(source);
  source->refuse = true;
  EXPECT_THROW(cache.pin({1, 1}), Error);
  EXPECT_THROW(cache.pin({1, 1}), Error);
  EXPECT_EQ(source->loads, 1);
  source->refuse = false;
  EXPECT_THROW(cache.pin({1, 1}), Error);
  EXPECT_NE(cache.load({1, 1}), nullptr);
  EXPECT_TRUE(cache.pin({1, 1}));
}

// With a budget of two tiles almost every step evicts under the readers.
TEST(TileCache, ReadersBesideTheEvictor) {
  const MemoryMap map = rolling_map(4);
  const std::size_t one = memory_bytes(*map.load({0, 0}));
  const TileCache cache(std::make_shared<CountingMap>(map), 2 * one);
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (std::uint64_t t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      test::Random random(t);
      for (int i = 0; i < 4000; ++i) {
        const TileId id{static_cast<std::int32_t>(random.between(0, 3)),
                        static_cast<std::int32_t>(random.between(0, 3))};
        const TileCache::Pin pin = cache.pin(id);
        wrong += pin->box != map.layout().grid.box_of(id) || pin->centre_mm.back() != map.load(id)->centre_mm.back();
        if (i % 16 == 0) wrong += cache.load(id)->nodes.size() != pin->nodes.size();
      }
    });
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_LE(cache.counts().bytes, 3 * one);
}

}  // namespace
}  // namespace btms
