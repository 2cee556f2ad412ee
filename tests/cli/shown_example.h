// A page's example is the program it says it is.
#pragma once

#include <array>
#include <cstdio>

#include "tests/cli/program.h"

namespace btms::test {

inline std::string trimmed(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(' ');
  return begin == std::string::npos ? "" : line.substr(begin);
}

// Every line of the page's first C++ block is in the program, in that order; blanks don't count.
inline void expect_shown(const std::string& page_name, const std::string& program_name) {
  const std::string source = BTMS_SOURCE_DIR;
  std::istringstream example(read_text(source + "/apps/examples/" + program_name));
  std::vector<std::string> lines;
  for (std::string line; std::getline(example, line);) lines.push_back(trimmed(line));
  const std::string page = read_text(source + "/docs/" + page_name);
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

// What an example that lies beside btms says, stderr included.
inline std::string example_says(const std::string& program, const std::string& arguments) {
  const std::string path = (fs::path(BTMS_PROGRAM).parent_path() / program).string();
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen((path + " " + arguments + " 2>&1").c_str(), "r"), pclose);
  std::string out;
  std::array<char, 4096> piece;
  while (const std::size_t n = std::fread(piece.data(), 1, piece.size(), pipe.get())) out.append(piece.data(), n);
  return out;
}

}  // namespace btms::test
