// The disk is looked at before the work.
#include "engine/tiling/spill.h"
#include "tests/cli/program.h"

namespace btms::test {
namespace {

// A scan of points that nobody can hold, in a file that takes no space.
class CliDisk : public testing::Test {
 protected:
  void SetUp() override {
    std::error_code error;
    fs::resize_file(make("scan.bin"), 6 * free_disk_bytes(folder_.path()) / 16 * 16, error);
    if (error) GTEST_SKIP() << "no file this large can be made here";
  }
  std::string make(const std::string& name) {
    write_text(folder_ / name, "");
    return folder_ / name;
  }
  void expect_refused(const Outcome& outcome, const std::string& advice) {
    EXPECT_EQ(outcome.status, 1) << outcome.err;
    EXPECT_NE(outcome.err.find("free some space"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find(advice), std::string::npos) << outcome.err;
  }
  TempFolder folder_;
};

TEST_F(CliDisk, ABuildThatCouldNotParkItsPointsIsRefused) {
  expect_refused(
      run({"build", folder_ / "scan.bin", "-o", folder_ / "map", "--preset", "paper-single-scan", "--memory", "128M"}),
      "--spill");
  EXPECT_EQ(names_in(folder_.path()), std::vector<std::string>{"scan.bin"});
}

TEST_F(CliDisk, LabelsThatWouldNotFitAreRefused) {
  write_scan(make("small.bin"), floor_and_wall());
  ASSERT_EQ(run({"build", folder_ / "small.bin", "-o", folder_ / "map", "--preset", "paper-single-scan"}).status, 0);
  expect_refused(run({"label", folder_ / "map", folder_ / "scan.bin", "-o", folder_ / "out"}), "output folder");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

}  // namespace
}  // namespace btms::test
