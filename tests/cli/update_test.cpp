// build --updatable, --update, --resume: what they keep to, and what they refuse.
#include <gmock/gmock.h>

#include "tests/cli/program.h"

namespace btms::test {
namespace {

using testing::HasSubstr;

class CliUpdate : public testing::Test {
 protected:
  void SetUp() override {
    run_json({"synth", "--scene", "city", "--points", "150000", "-o", in("city")});
    run_json({"synth", "--scene", "hills", "--points", "20000", "-o", in("more")});
    write_text(in("poses.txt"), "10 10 2\n20 10 2\n");
    write_text(in("other.txt"), "10 10 2\n20 11 2\n");
    run_json(
        {"build", in("city"), "-o", in("map"), "--updatable", "--crs", "EPSG:25832", "--trajectory", in("poses.txt")});
  }
  std::string in(const std::string& name) const { return folder_ / name; }
  std::string digest(const std::string& map) const { return run_json({"digest", in(map)})["digest"]; }
  Outcome update(std::vector<std::string> more) const {
    more.insert(more.begin(), {"build", "-o", in("map"), "--update", "-q"});
    return run(more);
  }
  TempFolder folder_;
};

TEST_F(CliUpdate, IsTheRebuildAndKeepsTheReferenceSystem) {
  const auto report = run_json({"build", in("more"), "-o", in("map"), "--update", "--trajectory", in("poses.txt")});
  EXPECT_LE(report["update"]["tiles_worked_on"], report["update"]["tiles_in_reach"]);
  run_json({"build", in("city"), in("more"), "-o", in("anew"), "--trajectory", in("poses.txt")});
  EXPECT_EQ(report["digest"], digest("anew"));
  EXPECT_THAT(run({"info", in("map")}).out, HasSubstr("EPSG:25832"));
  EXPECT_EQ(run({"verify", in("map"), "-q"}).status, 0);
  // And back again: the city alone.
  const std::string added = names_in(in("more")).front();
  EXPECT_EQ(update({"--trajectory", in("poses.txt"), "--remove", added}).status, 0);
  run_json({"build", in("city"), "-o", in("anew"), "--trajectory", in("poses.txt")});
  EXPECT_EQ(digest("map"), digest("anew"));
}

TEST_F(CliUpdate, RefusesWhatWouldMakeAnotherMap) {
  const std::string before = digest("map");
  EXPECT_EQ(update({in("more")}).status, 2);
  EXPECT_EQ(update({in("more"), "--trajectory", in("other.txt")}).status, 2);
  EXPECT_EQ(update({in("more"), "--trajectory", in("poses.txt"), "--resolution", "4"}).status, 2);
  EXPECT_EQ(update({in("more"), "--trajectory", in("poses.txt"), "--tile-cells", "7"}).status, 2);
  EXPECT_EQ(update({"--trajectory", in("poses.txt"), "--remove", "nobody.las"}).status, 2);
  fs::rename(in("city"), in("gone"));
  const Outcome gone = update({in("more"), "--trajectory", in("poses.txt")});
  EXPECT_EQ(gone.status, 2);
  EXPECT_THAT(gone.err, HasSubstr("is not there any more"));
  EXPECT_EQ(digest("map"), before);
}

// Older records would come to light again.
TEST_F(CliUpdate, RefusesDamagedOrMissingRecords) {
  ASSERT_EQ(update({in("more"), "--trajectory", in("poses.txt")}).status, 0);
  for (const std::string& name : names_in(in("map/rounds"))) {
    if (!name.ends_with(".r2")) continue;
    const fs::path file = in("map/rounds/" + name);
    const std::string good = read_text(file);
    std::string bad = good;
    bad[bad.size() - 20] = static_cast<char>(bad[bad.size() - 20] ^ 1);
    write_text(file, bad);
    EXPECT_EQ(update({"--trajectory", in("poses.txt")}).status, 4) << name;
    EXPECT_EQ(run({"verify", in("map"), "-q"}).status, 4) << name;
    fs::remove(file);
    EXPECT_EQ(update({"--trajectory", in("poses.txt")}).status, 4) << name;
    write_text(file, good);
    break;
  }
  EXPECT_EQ(update({"--trajectory", in("poses.txt")}).status, 0);
}

TEST_F(CliUpdate, ResumeOfAFinishedMapDoesNothingOrRefuses) {
  const std::vector<std::string> same = {"build",        in("city"),      "-o",    in("map"),    "--updatable",
                                         "--trajectory", in("poses.txt"), "--crs", "EPSG:25832", "--resume"};
  EXPECT_EQ(run_json(same)["finished_before"], true);
  const Outcome other = run({"build", in("more"), "-o", in("map"), "--resume", "-q"});
  EXPECT_EQ(other.status, 2);
  EXPECT_THAT(other.err, HasSubstr("inputs"));
}

}  // namespace
}  // namespace btms::test
