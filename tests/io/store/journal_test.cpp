#include "io/store/journal.h"

#include "tests/io/store/made_map.h"

namespace btms {
namespace {

class JournalFile : public testing::Test {
 protected:
  void add(std::int32_t column) const {
    ShardEntry shard;
    shard.id = {column, 0};
    shard.file = "x" + std::to_string(column) + "_y0.r1.nc";
    Journal(temporary_ / "", 0, 1, "{}").add({shard});
  }
  std::size_t entries() const {
    const auto interrupted = read_journals(temporary_ / "");
    return interrupted ? interrupted->entries.size() : 0;
  }

  const TemporaryFolder temporary_;
  const std::filesystem::path file_ = temporary_ / kJournal;
};

TEST_F(JournalFile, WhatABuildTakenUpTwiceHasCommittedCounts) {
  for (std::int32_t i = 0; i < 3; ++i) add(i);
  EXPECT_EQ(entries(), 3u);
}

TEST_F(JournalFile, WhatFollowsATornLineCounts) {
  add(0);
  add(1);
  const std::string text = file_text(file_);
  write_text(file_, text.substr(0, text.size() - 5));
  EXPECT_EQ(entries(), 1u);
  add(1);
  EXPECT_EQ(entries(), 2u);
}

TEST_F(JournalFile, IsBegunAfreshWhenItsHeadIsTorn) {
  add(0);
  write_text(file_, file_text(file_).substr(0, 20));
  add(0);
  EXPECT_EQ(entries(), 1u);
}

}  // namespace
}  // namespace btms
