// docs/http_api.md: every line of shell in it runs as it stands, and answers have the fields that are shown.
#include <array>
#include <csignal>
#include <thread>

#include "tests/cli/program.h"

namespace btms::test {
namespace {

using nlohmann::json;

struct Block {
  std::string kind, text;
};

// The fenced blocks of a page, in order.
std::vector<Block> blocks_of(const std::string& page) {
  std::vector<Block> blocks;
  std::istringstream lines(page);
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("```")) {
      inside = !inside;
      if (inside) blocks.push_back({line.substr(3), ""});
    } else if (inside) {
      blocks.back().text += line + "\n";
    }
  }
  return blocks;
}

struct Said {
  int status = -1;
  std::string out;
};

Said shell(const std::string& folder, const std::string& url, const std::string& script) {
  write_text(fs::path(folder) / "script",
             "set -eu\ncd '" + folder + "'\nurl=${BTMS_URL:-http://127.0.0.1:8080}\n" + script);
  FILE* pipe = popen(("BTMS_URL=" + url + " sh '" + folder + "/script' 2>&1").c_str(), "r");
  Said said;
  std::array<char, 4096> piece;
  while (const std::size_t n = std::fread(piece.data(), 1, piece.size(), pipe)) said.out.append(piece.data(), n);
  said.status = pclose(pipe);
  return said;
}

// The same fields everywhere; of arrays the first entries are compared.
void expect_alike(const json& said, const json& shown, const std::string& where) {
  ASSERT_EQ(said.is_object(), shown.is_object()) << where;
  ASSERT_EQ(said.is_array(), shown.is_array()) << where;
  if (shown.is_object()) {
    for (const auto& [key, value] : shown.items()) {
      ASSERT_TRUE(said.contains(key)) << where << "." << key;
      expect_alike(said[key], value, where + "." + key);
    }
    for (const auto& [key, value] : said.items())
      EXPECT_TRUE(shown.contains(key)) << where << "." << key << " is not shown";
  } else if (shown.is_array() && !shown.empty()) {
    ASSERT_FALSE(said.empty()) << where;
    expect_alike(said[0], shown[0], where + "[0]");
  } else if (shown.is_number() && where.ends_with(".z")) {
    EXPECT_NEAR(said.get<double>(), shown.get<double>(), 1e-3) << where;
  }
}

TEST(HttpDocs, EveryLineRuns) {
  if (std::system("curl --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "no curl: cmake/install-deps.sh";
  const TempFolder folder;
  run_json({"synth", "--points", "2000000", "-o", folder / "truth"});
  run_json({"build", folder / "truth", "-o", folder / "city.btms"});
  Running server({"serve", folder / "city.btms", "--port", "0"}, {}, folder / "said");
  std::string url;
  for (int i = 0; i < 500 && url.find('\n') == std::string::npos; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    url = read_text(folder / "said");
  }
  ASSERT_TRUE(url.starts_with("http://127.0.0.1:")) << server.err_so_far();
  url = url.substr(0, url.find_last_not_of("/\n") + 1);

  const std::vector<Block> blocks = blocks_of(read_text(std::string(BTMS_SOURCE_DIR) + "/docs/http_api.md"));
  std::size_t ran = 0, compared = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (blocks[i].kind != "sh") continue;
    const Said said = shell(folder.path().string(), url, blocks[i].text);
    ASSERT_EQ(said.status, 0) << blocks[i].text << said.out;
    ++ran;
    if (i + 1 == blocks.size() || blocks[i + 1].kind != "json") continue;
    const json answer = json::parse(said.out, nullptr, false), shown = json::parse(blocks[i + 1].text, nullptr, false);
    ASSERT_FALSE(shown.is_discarded()) << blocks[i + 1].text;
    ASSERT_FALSE(answer.is_discarded()) << said.out;
    expect_alike(answer, shown, blocks[i].text);
    ++compared;
  }
  EXPECT_GE(ran, 15u);
  EXPECT_GE(compared, 7u);
  server.send(SIGTERM);
  EXPECT_EQ(server.wait().status, 0);
}

}  // namespace
}  // namespace btms::test
