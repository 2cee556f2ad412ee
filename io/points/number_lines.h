// Text files of numbers: a row a line.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace btms {

// The numbers of a line between blanks or commas, into `out`; false where a word is no number. Values may be infinite
// or not a number.
bool parse_numbers(std::string_view line, std::vector<double>& out);

// Calls row(number of the line in the file from 1, its numbers) for every line in turn; the numbers last until it
// returns. Lines that start with # and empty ones are skipped. Throws what `row` throws, Error(kBadInput) naming file
// and line for a word that is no number and for a row that is not as long as the first, and naming the file where there
// is none (`what` is what a row would be: "pose"); Error(kUsage) where there is no such file, or it is too large;
// Error(kFailed) where it can't be read.
void read_number_lines(const std::filesystem::path& file, const char* what,
                       const std::function<void(std::size_t line, std::span<const double> values)>& row);

}  // namespace btms
