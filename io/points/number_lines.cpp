#include "io/points/number_lines.h"

#include <algorithm>
#include <charconv>
#include <string>

#include "engine/error.h"
#include "io/files/read_file.h"

namespace btms {
namespace {

constexpr std::uint64_t kLimit_bytes = std::uint64_t{1} << 30;

constexpr std::string_view kSeparators = " \t,\r", kByteOrderMark = "\xEF\xBB\xBF";

}  // namespace

bool parse_numbers(std::string_view line, std::vector<double>& out) {
  out.clear();
  while (true) {
    line.remove_prefix(std::min(line.find_first_not_of(kSeparators), line.size()));
    if (line.empty()) return true;
    std::string_view word = line.substr(0, line.find_first_of(kSeparators));
    line.remove_prefix(word.size());
    if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);  // from_chars knows no plus
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size()) return false;
    out.push_back(value);
  }
}

void read_number_lines(const std::filesystem::path& file, const char* what,
                       const std::function<void(std::size_t line, std::span<const double> values)>& row) {
  const std::vector<std::uint8_t> bytes = read_file(file, kLimit_bytes, ErrorCode::kUsage);
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  std::vector<double> values;
  std::size_t columns = 0;  // of the first row
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos || line[first] == '#') continue;
    const auto refuse = [&](const std::string& found) {
      throw Error(ErrorCode::kBadInput, "line " + std::to_string(line_number) + ": " + found, file.string());
    };
    if (!parse_numbers(line, values) || values.empty()) refuse("a word is no number");
    if (columns == 0) columns = values.size();
    if (values.size() != columns)
      refuse("found " + std::to_string(values.size()) + " numbers, the first " + what + " has " +
             std::to_string(columns));
    row(line_number, values);
  }
  if (columns == 0) throw Error(ErrorCode::kBadInput, "there is no " + std::string(what) + " in it", file.string());
}

}  // namespace btms
