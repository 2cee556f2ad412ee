#include "io/store/round_files.h"

#include "tests/io/store/made_map.h"

namespace btms {
namespace {

class RoundFolder : public testing::Test {
 protected:
  // What a rank of an interrupted build has saved.
  void save(int rank, int ranks) const {
    RoundFiles files(temporary_ / "", {.rank = rank, .ranks = ranks});
    files.save(3, {rank, 0}, std::vector<std::uint8_t>(1000, 7));
    files.finish(3);
  }
  bool is_saved() const { return RoundFiles(temporary_ / "", {.resume = true}).interrupted_after(3); }

  const TemporaryFolder temporary_;
};

TEST_F(RoundFolder, ANumberIsSavedWhenEveryRankHasItsFile) {
  save(0, 2);
  EXPECT_FALSE(is_saved());
  save(1, 2);
  EXPECT_TRUE(is_saved());
}

TEST_F(RoundFolder, FilesOfBuildsWithOtherRanksDoNotAddUp) {
  save(0, 2);
  save(0, 3);
  EXPECT_FALSE(is_saved());
  save(0, 1);
  EXPECT_TRUE(is_saved());
}

TEST_F(RoundFolder, ADamagedFileIsNotThere) {
  save(0, 1);
  const auto file = files_in(temporary_ / kRoundFolder)[0];
  std::string text = file_text(file);
  text[text.size() - 12] ^= 1;  // in the hash of the index
  write_text(file, text);
  EXPECT_FALSE(is_saved());
}

}  // namespace
}  // namespace btms
