// Text files of numbers: a row a line.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

namespace btms {

struct NumberLine {
  std::size_t line = 0;  // in the file, from 1
  std::vector<double> values;
};

// Numbers between blanks or commas; lines that start with # and empty ones are skipped. Throws Error(kBadInput) naming
// file and line for a word that is no number and for a row that is not as long as the first, and naming the file where
// there is none (`what` is what a row would be: "pose"); Error(kUsage) where there is no such file, or it is too large;
// Error(kFailed) where it can't be read. Values may be infinite or not a number.
std::vector<NumberLine> read_number_lines(const std::filesystem::path& file, const char* what);

}  // namespace btms
