#include "engine/tiling/executor.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <csignal>

#include "engine/error.h"

namespace btms {
namespace {

TEST(Threads, RunEveryPieceOnceAndNeverTwoOnOneWorker) {
  for (const auto& make :
       {+[] { return serial_threads(); }, +[] { return tbb_threads(1); }, +[] { return tbb_threads(4); }}) {
    const auto threads = make();
    std::vector<std::atomic<int>> runs(1000), busy(static_cast<std::size_t>(threads->count()));
    threads->for_each(runs.size(), [&](std::size_t i, int worker) {
      ASSERT_GE(worker, 0);
      ASSERT_LT(worker, threads->count());
      EXPECT_EQ(busy[static_cast<std::size_t>(worker)]++, 0);
      ++runs[i];
      --busy[static_cast<std::size_t>(worker)];
    });
    for (const auto& r : runs) EXPECT_EQ(r, 1);
    threads->for_each(0, [](std::size_t, int) { FAIL(); });
  }
}

TEST(Threads, PassExceptionsOn) {
  const auto threads = tbb_threads(2);
  EXPECT_THROW(threads->for_each(100,
                                 [](std::size_t i, int) {
                                   if (i == 50) throw Error(ErrorCode::kBadInput, "no");
                                 }),
               Error);
}

TEST(Ranks, ExchangeBytesOfAnySize) {
  run_forked_ranks(3, [](Ranks& ranks) {
    // Larger than any socket buffer, all at once, several times, empty ones among them.
    for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{5'000'000}, std::size_t{7}}) {
      std::vector<Bytes> out;
      for (int to = 0; to < ranks.size(); ++to)
        out.push_back(
            Bytes(size * static_cast<std::size_t>(to + 1), static_cast<std::uint8_t>(16 * ranks.rank() + to)));
      const std::vector<Bytes> in = ranks.exchange(out);
      for (int from = 0; from < ranks.size(); ++from)
        if (in[static_cast<std::size_t>(from)] != Bytes(size * static_cast<std::size_t>(ranks.rank() + 1),
                                                        static_cast<std::uint8_t>(16 * from + ranks.rank())))
          throw Error(ErrorCode::kVerification, "rank " + std::to_string(ranks.rank()) + " got something else");
    }
  });
}

TEST(Ranks, PoolListsOfAnyLength) {
  run_forked_ranks(3, [](Ranks& ranks) {
    const auto own = static_cast<std::size_t>(ranks.rank());
    std::vector<char> letters(own, static_cast<char>('a' + own));  // none of rank 0
    std::vector<std::uint64_t> numbers(3 - own, own);
    std::vector<int> none;
    ranks.pool(letters, numbers, none);
    if (letters != std::vector<char>{'b', 'c', 'c'} || numbers != std::vector<std::uint64_t>{0, 0, 0, 1, 1, 2} ||
        !none.empty())
      throw Error(ErrorCode::kVerification, "rank " + std::to_string(ranks.rank()) + " got something else");
  });
}

TEST(Ranks, AFailingRankEndsTheRunWithItsOwnMessage) {
  for (const int culprit : {0, 1, 2}) {
    try {
      run_forked_ranks(3, [&](Ranks& ranks) {
        ranks.exchange(std::vector<Bytes>(3));
        if (ranks.rank() == culprit) throw Error(ErrorCode::kBadInput, "lying file");
        ranks.exchange(std::vector<Bytes>(3, Bytes(1'000'000)));
        ranks.exchange(std::vector<Bytes>(3));
      });
      FAIL() << "nothing thrown";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kBadInput) << culprit << ": " << e.what();
      EXPECT_NE(std::string(e.what()).find("lying file"), std::string::npos) << e.what();
    }
  }
}

TEST(Ranks, AnErrorKeepsItsFileAndOffset) {
  try {
    run_forked_ranks(2, [](Ranks& ranks) {
      if (ranks.rank() == 1) throw Error(ErrorCode::kBadInput, "3 points: expected 4", "a b/c.las", 227);
      ranks.exchange(std::vector<Bytes>(2));
    });
    FAIL() << "nothing thrown";
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "a b/c.las:227: 3 points: expected 4");
    EXPECT_EQ(e.file(), "a b/c.las");
    EXPECT_EQ(e.offset(), 227u);
  }
}

TEST(Ranks, ARankThatJustLeavesIsAFailure) {
  EXPECT_THROW(run_forked_ranks(2,
                                [](Ranks& ranks) {
                                  if (ranks.rank() == 1) ::_exit(7);
                                }),
               Error);
  EXPECT_THROW(run_forked_ranks(2,
                                [](Ranks& ranks) {
                                  if (ranks.rank() == 1) throw 42;
                                }),
               Error);
}

TEST(Ranks, AKilledRankEndsTheRun) {
  try {
    run_forked_ranks(2, [](Ranks& ranks) {
      if (ranks.rank() == 1) ::raise(SIGKILL);
      ranks.exchange(std::vector<Bytes>(2));
    });
    FAIL() << "nothing thrown";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("signal 9"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace btms
