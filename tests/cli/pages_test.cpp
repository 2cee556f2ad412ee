// The manual page, the completion and the page of parameters: made from the program, and whole.
#include <gmock/gmock.h>

#include <regex>

#include "tests/cli/help_text.h"

namespace btms::test {
namespace {

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// Flags of the lines that begin with one: "  -o,--output FILE ...".
std::vector<std::string> flags_in_help(const std::vector<std::string>& words) {
  std::vector<std::string> flags;
  const std::regex first(R"(^  (-[^ ]+).*)"), flag(R"(--?[A-Za-z][A-Za-z0-9-]*)");
  for (const std::string& line : lines_of(run(words).out)) {
    if (line.starts_with("Example")) break;
    std::smatch match;
    if (!std::regex_match(line, match, first)) continue;
    const std::string names = match[1];
    for (std::sregex_iterator it(names.begin(), names.end(), flag), end; it != end; ++it) flags.push_back(it->str());
  }
  return flags;
}

// What bash offers for the last of the words.
std::vector<std::string> completed(const std::vector<std::string>& words) {
  static const std::string script = run({"completion", "bash"}).out;
  const TempFolder folder;
  std::string test = script + "COMP_WORDS=(";
  for (const std::string& word : words) test += "'" + word + "' ";
  test += ")\nCOMP_CWORD=" + std::to_string(words.size() - 1) + "\n_btms\nprintf '%s\\n' \"${COMPREPLY[@]}\"\n";
  write_text(folder / "test.bash", test);
  const std::string call = "bash " + folder / "test.bash";
  std::string said;
  FILE* pipe = popen(call.c_str(), "r");
  std::array<char, 4096> buffer{};
  while (std::fgets(buffer.data(), static_cast<int>(buffer.size()), pipe) != nullptr) said += buffer.data();
  EXPECT_EQ(pclose(pipe), 0);
  std::vector<std::string> answers = lines_of(said);
  std::erase(answers, "");
  return answers;
}

TEST(CliPages, BashCompletesEverySubcommandAndEveryOption) {
  const std::vector<std::string> names = subcommands();
  EXPECT_GE(names.size(), 17u);
  std::vector<std::string> first = names;
  for (const std::string& flag : flags_in_help({"--help"})) first.push_back(flag);
  EXPECT_THAT(completed({"btms", ""}), testing::UnorderedElementsAreArray(first));
  for (const std::string& name : names)
    EXPECT_THAT(completed({"btms", name, "-"}), testing::UnorderedElementsAreArray(flags_in_help({name, "--help"})))
        << name;
}

TEST(CliPages, BashCompletesValuesAndLeavesFilesToTheShell) {
  EXPECT_THAT(completed({"btms", "build", "--progress", "l"}), testing::ElementsAre("lines"));
  EXPECT_THAT(completed({"btms", "build", "a.las", "--preset", "paper-s"}), testing::ElementsAre("paper-single-scan"));
  EXPECT_THAT(completed({"btms", "bui"}), testing::ElementsAre("build"));
  EXPECT_THAT(completed({"btms", "build", ""}), testing::ElementsAre());
}

TEST(CliPages, TheManualPageHasEverySubcommandWithEveryOption) {
  const std::string page = run({"man"}).out;
  for (const std::string& name : subcommands()) {
    const std::size_t begin = page.find("\n.SS " + name + "\n");
    ASSERT_NE(begin, std::string::npos) << name;
    const std::string section = page.substr(begin, page.find("\n.S", begin + 1) - begin);
    EXPECT_NE(section.find("Example"), std::string::npos) << name;
    for (std::string flag : flags_in_help({name, "--help"})) {
      flag = std::regex_replace(flag, std::regex("-"), "\\-");
      EXPECT_NE(section.find("\\fB" + flag + "\\fR"), std::string::npos) << name << ' ' << flag;
    }
  }
}

TEST(CliPages, DocumentsOfTheParametersAreWhatTheProgramPrints) {
  const fs::path docs = fs::path(BTMS_SOURCE_DIR) / "docs";
  EXPECT_EQ(read_text(docs / "parameters.md"), run({"params", "--markdown"}).out)
      << "btms params --markdown > docs/parameters.md";
  EXPECT_EQ(read_text(docs / "config.schema.json"), run({"params", "--schema"}).out)
      << "btms params --schema > docs/config.schema.json";
}

TEST(CliPages, TheExampleConfigurationIsOne) {
  const TempFolder folder;
  write_scan(folder / "scan.bin", floor_and_wall());
  const std::string config = (fs::path(BTMS_SOURCE_DIR) / "docs/config.yaml").string();
  const auto info = run_json({"build", folder / "scan.bin", "-o", folder / "m.btms", "--config", config});
  EXPECT_EQ(run_json({"info", folder / "m.btms"})["parameters"]["vehicle_width_m"], 0.8) << info;
}

}  // namespace
}  // namespace btms::test
