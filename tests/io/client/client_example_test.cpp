// The example of docs/client.md: it is what the page shows, and it runs.
#include "tests/cli/shown_example.h"
#include "tests/io/client/real_server.h"

namespace btms::test {
namespace {

TEST(ClientExample, IsWhatThePageShows) { expect_shown("client.md", "ask_server.cpp"); }

TEST(ClientExample, Runs) {
  const TempFolder folder;
  run_json({"synth", "--points", "100000", "-o", folder / "truth"});
  run_json({"build", folder / "truth", "-o", folder / "city.btms"});
  const RealServer server(folder / "city.btms");
  const auto said = [](const std::string& arguments) { return example_says("ask_server", arguments); };
  const std::string answer = said(server.options().url + " city 50 50");
  for (const char* part : {"city, revision 1", "height ", "safe", "route ", " tiles, elevation here "})
    EXPECT_NE(answer.find(part), std::string::npos) << answer;
  EXPECT_NE(said(server.options().url + " town 50 50").find("unknown_map"), std::string::npos);
}

}  // namespace
}  // namespace btms::test
