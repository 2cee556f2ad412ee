// What --help says, taken apart.
#pragma once

#include "tests/cli/program.h"

namespace btms::test {

// The list under "Subcommands:".
inline std::vector<std::string> subcommands() {
  std::istringstream help(run({"--help"}).out);
  std::vector<std::string> names;
  std::string line;
  while (std::getline(help, line) && line != "Subcommands:") continue;
  while (std::getline(help, line) && line.starts_with("  ")) names.push_back(line.substr(2, line.find(' ', 2) - 2));
  return names;
}

}  // namespace btms::test
