// The example of docs/client.md: it is what the page shows, and it runs.
#include <array>
#include <cstdio>

#include "tests/cli/program.h"
#include "tests/io/client/real_server.h"

namespace btms::test {
namespace {

std::string trimmed(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(' ');
  return begin == std::string::npos ? "" : line.substr(begin);
}

TEST(ClientExample, IsWhatThePageShows) {
  const std::string source = BTMS_SOURCE_DIR;
  std::istringstream example(read_text(source + "/apps/examples/ask_server.cpp"));
  std::vector<std::string> lines;
  for (std::string line; std::getline(example, line);) lines.push_back(trimmed(line));
  const std::string page = read_text(source + "/docs/client.md");
  const std::size_t begin = page.find("```cpp\n") + 7;
  std::istringstream shown(page.substr(begin, page.find("```", begin) - begin));
  auto at = lines.begin();
  int compared = 0;
  for (std::string line; std::getline(shown, line);) {
    if (line.empty()) continue;
    at = std::find(at, lines.end(), trimmed(line));
    ASSERT_NE(at, lines.end()) << line;
    ++compared;
  }
  EXPECT_GT(compared, 20);
}

TEST(ClientExample, Runs) {
  const TempFolder folder;
  run_json({"synth", "--points", "100000", "-o", folder / "truth"});
  run_json({"build", folder / "truth", "-o", folder / "city.btms"});
  const RealServer server(folder / "city.btms");
  const auto said = [&](const std::string& arguments) {
    const std::string program = (fs::path(BTMS_PROGRAM).parent_path() / "ask_server").string();
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen((program + " " + arguments + " 2>&1").c_str(), "r"), pclose);
    std::string out;
    std::array<char, 4096> piece;
    while (const std::size_t n = std::fread(piece.data(), 1, piece.size(), pipe.get())) out.append(piece.data(), n);
    return out;
  };
  const std::string answer = said(server.options().url + " city 50 50");
  for (const char* part : {"city, revision 1", "height ", "safe", "route ", " tiles, elevation here "})
    EXPECT_NE(answer.find(part), std::string::npos) << answer;
  EXPECT_NE(said(server.options().url + " town 50 50").find("unknown_map"), std::string::npos);
}

}  // namespace
}  // namespace btms::test
