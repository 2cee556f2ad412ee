#include "io/points/trajectory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/error.h"
#include "tests/io/points/files.h"

namespace btms::test {
namespace {

std::filesystem::path written(const std::string& text) {
  static const TemporaryFolder folder;
  return folder.write("trajectory.txt", text);
}

TEST(Trajectory, IsToldByItsColumns) {
  const auto plain = read_trajectory(written("# x y z\n1 2 3\n\n-0.5,1e3, 2.0006\r\n"));
  ASSERT_EQ(plain.size(), 2u);
  EXPECT_EQ(plain[0].x_mm, 1000);
  EXPECT_EQ(plain[1].x_mm, -500);
  EXPECT_EQ(plain[1].y_mm, 1'000'000);
  EXPECT_EQ(plain[1].z_mm, 2001);
  const auto tum = read_trajectory(written("1305031910.7 4 5 6 0 0 0 1"));
  ASSERT_EQ(tum.size(), 1u);
  EXPECT_EQ(tum[0].y_mm, 5000);
  const auto kitti = read_trajectory(written("1 0 0 7  0 1 0 8  0 0 1 9\n"));
  ASSERT_EQ(kitti.size(), 1u);
  EXPECT_EQ(kitti[0].x_mm, 7000);
  EXPECT_EQ(kitti[0].z_mm, 9000);
}

TEST(Trajectory, TakesASignAndTheMarkEditorsWrite) {
  const auto poses = read_trajectory(written("\xEF\xBB\xBF+1 -2 +3e1\n+4,5,6"));
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[0].x_mm, 1000);
  EXPECT_EQ(poses[0].z_mm, 30'000);
  EXPECT_EQ(poses[1].x_mm, 4000);
}

// What refuses a text; empty where nothing does.
std::string refusal(const std::string& text) {
  try {
    read_trajectory(written(text));
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kBadInput) << text;
    return e.what();
  }
  ADD_FAILURE() << "taken: " << text;
  return {};
}

TEST(Trajectory, RefusesWhatIsNone) {
  for (const char* text : {"", "\xEF\xBB\xBF", "# nothing\n", "1 2 3\n1 2 x\n", "nan 0 0\n", "1e300 0 0\n", "0 0 inf\n",
                           "2024-11-22\n", "1-2-3\n", "1 2 3m\n", "1 2 +-3\n", "1 2 ++3\n", "1 2 +\n", "1;2;3\n"})
    refusal(text);
  EXPECT_THAT(refusal("1 2 3\n\n4 5\n"), testing::HasSubstr("line 3: found 2 numbers"));
  EXPECT_THAT(refusal("1 2 3 4\n"), testing::HasSubstr("line 1: found 4 numbers"));
  try {
    read_trajectory("no/such/file");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kUsage);
  }
}

TEST(Trajectory, HasOneShape) {
  EXPECT_THAT(refusal("1 2 3\n0 4 5 6 0 0 0 1\n"), testing::HasSubstr("line 2: found 8 numbers, the first pose has 3"));
}

}  // namespace
}  // namespace btms::test
