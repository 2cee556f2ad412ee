#include "io/store/part_ranks.h"

#include <gmock/gmock.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "engine/error.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Parts : public testing::Test {
 protected:
  std::unique_ptr<Ranks> part(int i, int n = 3, double wait_s = 0, const std::string& identity = "{}") const {
    return part_ranks(folder_, {.part = i, .parts = n, .identity = identity, .wait_s = wait_s});
  }
  // What the work of a part says to part r in its k-th exchange.
  static Bytes word(int from, int to, int k) {
    return Bytes(static_cast<std::size_t>(100 * k + 10 * from + to), static_cast<std::uint8_t>(from));
  }
  // Three rounds of work. True when it came to its end.
  bool work(int i) const {
    const auto ranks = part(i);
    try {
      for (int k = 0; k < 3; ++k) {
        ranks->enter(k < 2 ? "early" : "late");
        std::vector<Bytes> out;
        for (int to = 0; to < 3; ++to) out.push_back(word(i, to, k));
        const std::vector<Bytes> in = ranks->exchange(out);
        for (int from = 0; from < 3; ++from) EXPECT_EQ(in[static_cast<std::size_t>(from)], word(from, i, k));
        const auto all = ranks->gather(std::vector<int>{i + 10 * k});
        EXPECT_EQ(all, (std::vector<int>{10 * k, 1 + 10 * k, 2 + 10 * k}));
      }
      return true;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kUnfinished) << e.what();
      EXPECT_THAT(e.what(), HasSubstr("waits for part"));
      return false;
    }
  }
  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_ / "a.parts";
};

std::string error_of(const std::function<void()>& body, ErrorCode code) {
  try {
    body();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), code) << e.what();
    return e.what();
  }
  ADD_FAILURE() << "nothing thrown";
  return {};
}

TEST_F(Parts, OneAfterAnotherTheyComeToTheEnd) {
  int turns = 0;
  for (bool all = false; !all; ++turns) {
    ASSERT_LT(turns, 10);
    all = true;
    for (int i = 0; i < 3; ++i) all = work(i) && all;
  }
  EXPECT_GT(turns, 3);
  const PartsState state = read_parts(folder_);
  EXPECT_EQ(state.parts, 3);
  EXPECT_THAT(state.reached, testing::Each(std::string("late")));
}

TEST_F(Parts, AtOnceTheyNeedOneTurn) {
  std::vector<std::thread> threads;
  std::atomic<int> sum = 0;
  for (int i = 0; i < 3; ++i)
    threads.emplace_back([&, i] {
      const auto ranks = part(i, 3, 20);
      for (int k = 0; k < 20; ++k) sum += ranks->sum<int>({i})[0];
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(sum, 3 * 20 * 3);
}

TEST_F(Parts, WhatAPartHasSaidStays) {
  EXPECT_THROW(part(0)->gather(std::vector<int>{7}), Error);
  EXPECT_THROW(part(0)->gather(std::vector<int>{8}), Error);  // the clock, say
  EXPECT_THROW(part(1)->gather(std::vector<int>{1}), Error);
  EXPECT_EQ(part(2)->gather(std::vector<int>{2}), (std::vector<int>{7, 1, 2}));
  EXPECT_EQ(part(0)->gather(std::vector<int>{9}), (std::vector<int>{7, 1, 2}));
}

TEST_F(Parts, RefuseWhatIsNotTheirs) {
  const auto first = part(0);
  EXPECT_THAT(error_of([&] { part(0); }, ErrorCode::kFailed), HasSubstr("part 1 of 3 is at work already"));
  EXPECT_THAT(error_of([&] { part(1, 4); }, ErrorCode::kUsage), HasSubstr("messages of 3 parts"));
  EXPECT_THAT(error_of([&] { part(1, 3, 0, R"({"inputs":1})"); }, ErrorCode::kUsage),
              HasSubstr("another build: inputs"));
}

TEST_F(Parts, NoticeDamage) {
  EXPECT_THROW(part(0, 2)->gather(std::vector<int>{7, 8, 9}), Error);
  for (const auto& entry : fs::directory_iterator(folder_)) {
    if (!entry.path().filename().string().starts_with("points")) continue;
    for (const std::streamoff at : {0, 8, 16, 24, 33}) {
      std::fstream file(entry.path(), std::ios::in | std::ios::out | std::ios::binary);
      const auto flip = [&] {
        file.seekg(at);
        const auto byte = static_cast<char>(file.get() ^ 0x40);
        file.seekp(at);
        file.put(byte).flush();
      };
      flip();
      EXPECT_THAT(error_of([&] { part(1, 2)->gather(std::vector<int>{1}); }, ErrorCode::kVerification),
                  HasSubstr("damaged"));
      flip();
    }
  }
  EXPECT_EQ(part(1, 2)->gather(std::vector<int>{1}), (std::vector<int>{7, 8, 9, 1}));
}

}  // namespace
}  // namespace btms
