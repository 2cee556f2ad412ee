// Job arrays: parts of a build, run at once or one after another, end with the map of one build.
#include <gmock/gmock.h>

#include <chrono>
#include <thread>

#include "tests/cli/program.h"

namespace btms::test {
namespace {

using testing::HasSubstr;

class CliParts : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(run({"synth", "--points", "60000", "-o", city_, "-q"}).status, 0);
    digest_ = run_json({"build", city_, "-o", temporary_ / "one.btms", "-q"})["digest"];
  }
  std::vector<std::string> part(int i, int n, const std::string& wait = "0") const {
    return {"build", city_, "-o", map_, "-q", "--part", std::to_string(i) + "/" + std::to_string(n), "--wait", wait};
  }
  const TempFolder temporary_;
  const std::string city_ = temporary_ / "city", map_ = temporary_ / "map.btms";
  std::string digest_;
};

TEST_F(CliParts, OneAfterAnother) {
  for (auto& words : {part(1, 2), part(2, 2)}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.status, 5) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("run the parts again"));
    EXPECT_EQ(run({"info", map_}).status, 2);  // nothing under the map's name
  }
  EXPECT_THAT(run({"join", map_}).out, HasSubstr("part 2: points"));
  int turns = 1;
  for (; run({"join", map_}).status == 5; ++turns) {
    ASSERT_LT(turns, 40);
    for (int i = 1; i <= 2; ++i) {
      const Outcome outcome = run(part(i, 2));
      ASSERT_TRUE(outcome.status == 0 || outcome.status == 5) << outcome.err;
    }
  }
  EXPECT_GT(turns, 10);
  EXPECT_EQ(run_json({"join", map_})["digest"], digest_);
  EXPECT_EQ(run_json({"info", map_})["digest"], digest_);
  EXPECT_THAT(names_in(temporary_.path()), testing::ElementsAre("city", "map.btms", "one.btms"));
  EXPECT_EQ(run({"verify", map_, "-q"}).status, 0);
}

TEST_F(CliParts, AtOnceAndOneIsKilled) {
  Running first(part(1, 3, "60")), second(part(2, 3, "60"));
  {
    Running third(part(3, 3, "60"));
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    third.send(SIGKILL);
    third.wait();
  }
  Running third(part(3, 3, "60"));
  for (Running* r : {&first, &second, &third}) {
    const Outcome outcome = r->wait();
    EXPECT_EQ(outcome.status, 0) << outcome.err;
  }
  EXPECT_EQ(run_json({"join", map_})["digest"], digest_);
}

TEST_F(CliParts, TheOnlyOneBuildsTheMap) {
  for (int turn = 0; turn < 2; ++turn) {
    EXPECT_EQ(run(part(1, 1)).status, 0);
    EXPECT_EQ(run_json({"join", map_})["digest"], digest_);
  }
}

TEST_F(CliParts, RefuseWhatDoesNotFit) {
  EXPECT_EQ(run(part(1, 2)).status, 5);
  const Outcome more = run(part(1, 3));
  EXPECT_EQ(more.status, 2);
  EXPECT_THAT(more.err, HasSubstr("messages of 2 parts"));
  auto other = part(2, 2);
  other.insert(other.end(), {"--resolution", "4"});
  const Outcome another = run(other);
  EXPECT_EQ(another.status, 2);
  EXPECT_THAT(another.err, HasSubstr("another"));
  for (const char* text : {"0/2", "3/2", "2/1", "1", "a/b", "1/5000"}) {
    const Outcome wrong = run({"build", city_, "-o", map_, "--part", text});
    EXPECT_EQ(wrong.status, 2) << text;
    EXPECT_THAT(wrong.err, HasSubstr("expected I/N")) << text;
  }
  EXPECT_EQ(run({"join", temporary_ / "none.btms"}).status, 2);
}

}  // namespace
}  // namespace btms::test
