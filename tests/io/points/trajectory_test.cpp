#include "io/points/trajectory.h"

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

TEST(Trajectory, RefusesWhatIsNone) {
  for (const char* text : {"", "# nothing\n", "1 2\n", "1 2 3\n1 2 x\n", "nan 0 0\n", "1e300 0 0\n", "0 0 inf\n"})
    EXPECT_THROW(read_trajectory(written(text)), Error) << text;
  try {
    read_trajectory(written("1 2 3\n\n4 5\n"));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kBadInput);
    EXPECT_NE(std::string(e.what()).find("line 3"), std::string::npos) << e.what();
  }
  EXPECT_THROW(read_trajectory("no/such/file"), Error);
}

}  // namespace
}  // namespace btms::test
