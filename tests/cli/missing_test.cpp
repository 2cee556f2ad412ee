// What is not there is a usage error everywhere; what is no map is said to be none.
#include "tests/cli/program.h"

namespace btms::test {
namespace {

TEST(CliMissing, IsAUsageErrorThatNamesThePath) {
  const TempFolder folder;
  write_scan(folder / "scan.bin", floor_and_wall());
  const std::string nothing = folder / "nothing.las";
  for (const std::vector<std::string>& call : {std::vector<std::string>{"build", nothing, "-o", folder / "m.btms"},
                                               {"build", folder / "no/*.las", "-o", folder / "m.btms"},
                                               {"segment", nothing, "-o", folder / "out"},
                                               {"label", nothing, folder / "scan.bin", "-o", folder / "out"},
                                               {"info", nothing},
                                               {"query", nothing, "--at", "1,2"},
                                               {"digest", nothing},
                                               {"verify", nothing},
                                               {"diff", nothing, nothing},
                                               {"eval", "--truth", nothing, "--prediction", nothing}}) {
    const Outcome outcome = run(call);
    EXPECT_EQ(outcome.status, 2) << call[0] << outcome.err;
    EXPECT_NE(outcome.err.find(folder.path().string() + "/no"), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "") << call[0];
  }
}

TEST(CliMissing, AFolderThatIsNoMapIsCalledSo) {
  const TempFolder folder;
  write_scan(folder / "scan.bin", floor_and_wall());
  const auto says = [&](const std::string& words) {
    for (const std::vector<std::string>& call : {std::vector<std::string>{"info", folder.path()},
                                                 {"query", folder.path(), "--at", "1,2"},
                                                 {"digest", folder.path()},
                                                 {"verify", folder.path()},
                                                 {"diff", folder.path(), folder.path()},
                                                 {"label", folder.path(), folder / "scan.bin", "-o", folder / "out"}}) {
      const Outcome outcome = run(call);
      EXPECT_EQ(outcome.status, 3) << call[0] << outcome.err;
      EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    }
  };
  says("no manifest.json in it");
  write_text(folder / "manifest.json", "{\"xxh3\": oops");
  says("not a B-TMS map");
}

TEST(CliMissing, AnUnknownSubcommandIsNamed) {
  const Outcome outcome = run({"fly", "--json"});
  EXPECT_EQ(outcome.status, 2);
  for (const char* word : {"`fly`", "build", "synth"})
    EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace btms::test
