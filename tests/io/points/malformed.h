// A file that is not what it should be, and what is said of it. The number is that of the list of malformed inputs in
// docs/malformed_inputs.md.
#pragma once

#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/io/points/files.h"

namespace btms::test {

struct Malformed {
  int number;
  const char* name;
  std::vector<std::string> says;  // of the error, or one of each warning
  std::function<Bytes()> make;
};
inline void PrintTo(const Malformed& row, std::ostream* out) { *out << row.number << ' ' << row.name; }

}  // namespace btms::test
