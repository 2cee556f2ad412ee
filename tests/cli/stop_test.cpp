// Ctrl-C: exit 130, a message, and nothing half-written.
#include <chrono>
#include <thread>

#include "tests/cli/program.h"

namespace btms::test {
namespace {

constexpr const char* kPoints = "4000000";

// Starts the call, lets it work for a while, interrupts it. False when it had not begun, or was done, before the
// signal.
bool interrupt(const std::vector<std::string>& call, int after_ms, int signal) {
  Running running(call);
  std::this_thread::sleep_for(std::chrono::milliseconds(after_ms));
  if (running.has_ended()) return false;
  running.send(signal);
  const Outcome outcome = running.wait();
  if (outcome.status == 0) return false;  // it had passed its point of no return
  // It had not begun: signals are watched from the first read on. (Ended by SIGINT is 130, too.)
  if (outcome.status == 128 + signal && outcome.err.find("stopped") == std::string::npos) return false;
  EXPECT_EQ(outcome.status, 130) << outcome.err;
  EXPECT_NE(outcome.err.find("stopped"), std::string::npos) << outcome.err;
  return true;
}

class CliStop : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TempFolder>();
    run_json({"synth", "--points", kPoints, "-o", *folder_ / "truth"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static inline std::unique_ptr<TempFolder> folder_;
};

TEST_F(CliStop, AnInterruptedBuildLeavesNoMap) {
  int stopped = 0;
  for (const std::string executor : {"serial", "tbb", "ranks:2"})
    for (const int after_ms : {30, 150, 400}) {
      const TempFolder out;
      const bool was_stopped = interrupt({"build", *folder_ / "truth", "-o", out / "map.btms", "--executor", executor},
                                         after_ms, after_ms == 30 ? SIGTERM : SIGINT);
      if (!was_stopped) continue;
      ++stopped;
      EXPECT_TRUE(names_in(out.path()).empty())
          << executor << ' ' << after_ms << testing::PrintToString(names_in(out.path()));
    }
  EXPECT_GT(stopped, 0);
}

TEST_F(CliStop, AnInterruptedRebuildLeavesTheOlderMap) {
  const TempFolder out;
  write_scan(out / "scan.bin", floor_and_wall());
  const auto older = run_json({"build", out / "scan.bin", "-o", out / "map.btms"});
  const auto before = names_in(out / "map.btms");
  for (const int after_ms : {50, 250})
    if (interrupt({"build", *folder_ / "truth", "-o", out / "map.btms", "--executor", "serial"}, after_ms, SIGINT)) {
      EXPECT_EQ(names_in(out / "map.btms"), before);
      EXPECT_EQ(run_json({"digest", out / "map.btms"})["digest"], older["digest"]);
    }
}

TEST_F(CliStop, InterruptedSynthAndLabelLeaveNoPartOfAFile) {
  const TempFolder out;
  if (interrupt({"synth", "--points", "20000000", "-o", out / "synth"}, 100, SIGINT)) {
    EXPECT_TRUE(names_in(out / "synth").empty());
  }
  // Of a drive whole scans may be there, but nothing says that it is complete.
  if (interrupt({"synth", "--drive", "--scans", "400", "-o", out / "drive"}, 1500, SIGINT)) {
    EXPECT_FALSE(fs::exists(out / "drive/poses.txt"));
    for (const std::string& name : names_in(out / "drive/velodyne")) {
      EXPECT_EQ(fs::path(name).extension(), ".bin") << name;
      EXPECT_EQ(fs::file_size(out / ("drive/velodyne/" + name)) % 16, 0u);
    }
  }
  run_json({"build", *folder_ / "truth", "-o", out / "map.btms"});
  if (interrupt({"label", out / "map.btms", *folder_ / "truth", "-o", out / "labels", "-j", "1"}, 60, SIGINT)) {
    EXPECT_TRUE(!fs::exists(out / "labels") || names_in(out / "labels").empty());
  }
}

}  // namespace
}  // namespace btms::test
