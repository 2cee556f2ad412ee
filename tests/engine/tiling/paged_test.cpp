// What doesn't fit the memory budget comes back from disk as it was.
#include "engine/tiling/paged.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <numeric>

#include "engine/error.h"
#include "engine/tiling/executor.h"

namespace btms {
namespace {

using Numbers = std::vector<std::uint64_t>;
constexpr std::size_t kCount = 1000;

Numbers numbers_of(std::size_t i) {
  Numbers n(kCount + i % 3);
  std::iota(n.begin(), n.end(), i * 1'000'000);
  return n;
}

TEST(Paged, ElementsComeBackFromDiskAsTheyWere) {
  Pager pager(5 * kCount * sizeof(std::uint64_t), ".");
  Paged<Numbers> list(pager, 40);
  for (std::size_t i = 0; i < list.size(); ++i) *list.edit(i) = numbers_of(i);
  EXPECT_GT(pager.spill().bytes_written(), 30 * kCount * sizeof(std::uint64_t));
  for (std::size_t i = 0; i < list.size(); ++i) EXPECT_EQ(*list.view(i), numbers_of(i)) << i;
  EXPECT_LE(pager.peak_bytes(), 7 * kCount * sizeof(std::uint64_t));
}

TEST(Paged, WhatIsOnlyLookedAtIsNotWrittenAgain) {
  Pager pager(0, ".");
  Paged<Numbers> list(pager, 10);
  for (std::size_t i = 0; i < list.size(); ++i) *list.edit(i) = numbers_of(i);
  const std::uint64_t once = pager.spill().bytes_written();
  for (int k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < list.size(); ++i) ASSERT_EQ(*list.view(i), numbers_of(i));
  EXPECT_EQ(pager.spill().bytes_written(), once);
  (*list.edit(3))[7] = 42;
  EXPECT_GT(pager.spill().bytes_written(), once);
  EXPECT_EQ((*list.view(3))[7], 42u);
}

TEST(Paged, AnElementMayGrowAndShrink) {
  Pager pager(0, ".");
  Paged<Numbers> list(pager, 3);
  for (const std::size_t size : {10u, 1000u, 0u, 20u}) {
    for (std::size_t i = 0; i < list.size(); ++i) list.edit(i)->assign(size, i);
    for (std::size_t i = 0; i < list.size(); ++i) EXPECT_EQ(*list.view(i), Numbers(size, i));
  }
}

TEST(Paged, WhatIsInUseStaysInMemory) {
  Pager pager(0, ".");
  Paged<Numbers> list(pager, 5);
  const auto held = list.edit(0);
  *held = numbers_of(0);
  const std::uint64_t* where = held->data();
  for (std::size_t i = 1; i < list.size(); ++i) *list.edit(i) = numbers_of(i);
  EXPECT_EQ(list[0].data(), where);
  EXPECT_EQ(*held, numbers_of(0));
}

TEST(Paged, ManyThreadsMayUseTheSameElements) {
  Pager pager(3 * kCount * sizeof(std::uint64_t), ".");
  Paged<Numbers> list(pager, 16);
  for (std::size_t i = 0; i < list.size(); ++i) *list.edit(i) = numbers_of(i);
  std::atomic<int> wrong = 0;
  tbb_threads(4)->for_each(4000, [&](std::size_t k, int) {
    const std::size_t i = k * 7 % list.size(), j = k * 11 % list.size();
    const InUse both({reads(list)}, i);
    const auto other = list.view(j);
    wrong += list[i] != numbers_of(i) || *other != numbers_of(j);
  });
  EXPECT_EQ(wrong, 0);
}

TEST(Paged, NothingIsLeftOnDisk) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "btms_paged_test";
  std::filesystem::create_directory(folder);
  {
    Pager pager(0, folder);
    Paged<Numbers> list(pager, 4);
    for (std::size_t i = 0; i < list.size(); ++i) *list.edit(i) = numbers_of(i);
    EXPECT_GT(pager.spill().bytes_written(), 0u);
    EXPECT_TRUE(std::filesystem::is_empty(folder)) << "a crash now would leave a file";
  }
  std::filesystem::remove(folder);
}

TEST(Paged, AMissingFolderIsAnError) {
  Pager pager(0, "/nowhere/at/all");
  Paged<Numbers> list(pager, 2);
  *list.edit(0) = numbers_of(0);  // can't be parked, stays
  EXPECT_EQ(list[0], numbers_of(0));
  EXPECT_THROW(list.edit(1), Error);
}

// Of two buffers, the second doesn't fit a file of 4096 bytes.
struct Pair {
  Numbers small, large;
  template <class Fn>
  void for_each_buffer(const Fn& fn) {
    fn(small), fn(large);
  }
};

TEST(Paged, AFullDiskIsAnErrorAndLosesNothing) {
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit little{4096, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &little);
  {
    Pager pager(0, ".");
    Paged<Pair> list(pager, 2);
    *list.edit(0) = {{1, 2, 3}, numbers_of(0)};
    EXPECT_EQ(list[0].small, (Numbers{1, 2, 3})) << "freed before the rest was written";
    EXPECT_EQ(list[0].large, numbers_of(0));
    try {
      list.view(0);
      ADD_FAILURE();
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kFailed);
    }
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
}

TEST(Paged, ADiskWithoutTheRoomIsAnError) {
  EXPECT_NO_THROW(require_disk(".", 0, "or not"));
  EXPECT_THROW(require_disk(".", UINT64_MAX - 1, "or not"), Error);
}

}  // namespace
}  // namespace btms
