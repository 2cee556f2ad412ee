// The example of docs/query_library.md: it is what the page shows, and it runs.
#include "tests/cli/shown_example.h"

namespace btms::test {
namespace {

TEST(QueryExample, IsWhatThePageShows) { expect_shown("query_library.md", "query_map.cpp"); }

TEST(QueryExample, Runs) {
  const TempFolder folder;
  run_json({"synth", "--points", "100000", "-o", folder / "truth"});
  run_json({"build", folder / "truth", "-o", folder / "city.btms"});
  const auto outcome = [](const std::string& arguments) { return example_says("query_map", arguments); };
  const std::string answer = outcome(folder / "city.btms" + " 50 50 60 55");
  EXPECT_NE(answer.find("height "), std::string::npos) << answer;
  EXPECT_NE(answer.find("safe"), std::string::npos) << answer;
  EXPECT_NE(outcome(folder / "city.btms" + " 9e5 50 60 55").find("no height: outside"), std::string::npos);
  EXPECT_NE(outcome(folder / "nothing" + " 1 1 2 2").find("query_map: "), std::string::npos);
}

}  // namespace
}  // namespace btms::test
