#include "io/points/xyz_header.h"

#include <algorithm>
#include <charconv>

#include "engine/error.h"
#include "io/points/fields.h"

namespace btms {
namespace {

constexpr std::size_t kLongest_bytes = std::size_t{1} << 18;  // of all that stands above the points
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

using Words = std::vector<std::string>;

struct Columns {
  std::array<std::optional<std::size_t>, 3> xyz;
  std::optional<std::size_t> label;
  bool complete() const { return xyz[0] && xyz[1] && xyz[2]; }
};

char delimiter_of(std::string_view line) {
  for (const char c : {';', ','})
    if (line.find(c) != line.npos) return c;
  return 0;
}

Words words_of(std::string_view line, char delimiter) {
  Words words;
  std::string_view word;
  for (Fields fields(line, delimiter); fields.next(word);) words.emplace_back(word);
  return words;
}

std::string plain_name(std::string_view word) {
  if (word.size() > 1 && word.front() == '"' && word.back() == '"') word = word.substr(1, word.size() - 2);
  std::string name(word);
  for (char& c : name)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return name;
}

std::string listed(const Words& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text.size() > 60 ? text.substr(0, 60) + "..." : text;
}

// The columns by their names; twice is told from once by `twice`.
Columns named_columns(const Words& words, std::string& twice) {
  struct Name {
    std::string_view name;
    std::size_t column;  // 0 to 2: x, y, z; 3: class
  };
  static constexpr Name kNames[] = {
      {"x", 0},         {"easting", 0}, {"y", 1},     {"northing", 1},       {"z", 2},
      {"elevation", 2}, {"height", 2},  {"class", 3}, {"classification", 3}, {"label", 3}};
  Columns columns;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string name = plain_name(words[i]);
    for (const Name& known : kNames) {
      if (known.name != name) continue;
      std::optional<std::size_t>& to = known.column == 3 ? columns.label : columns.xyz[known.column];
      if (to) twice = name;
      to = i;
    }
  }
  return columns;
}

[[noreturn]] void refuse_option(const std::string& text, const std::string& why) {
  throw Error(ErrorCode::kUsage,
              "--columns: found `" + text + "`, " + why +
                  "; expected where x, y and z are (2,3,4), or the names of the columns (id,x,y,z,class)");
}

// "2,3,4", or names.
Columns chosen_columns(const std::string& text) {
  const Words words = words_of(text, ',');
  Columns columns;
  std::vector<std::size_t> numbers;
  for (const std::string& word : words) {
    std::size_t number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error == std::errc{} && end == word.data() + word.size() && number > 0) numbers.push_back(number - 1);
  }
  if (numbers.empty()) {
    std::string twice;
    columns = named_columns(words, twice);
    if (!twice.empty()) refuse_option(text, twice + " is there twice");
    if (!columns.complete()) refuse_option(text, "x, y or z is missing");
    return columns;
  }
  if (numbers.size() != words.size() || numbers.size() < 3 || numbers.size() > 4)
    refuse_option(text, "three columns are counted from 1, or four with the class");
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (std::find(numbers.begin(), numbers.begin() + static_cast<std::ptrdiff_t>(i), numbers[i]) !=
        numbers.begin() + static_cast<std::ptrdiff_t>(i))
      refuse_option(text, "a column is there twice");
  for (std::size_t axis = 0; axis < 3; ++axis) columns.xyz[axis] = numbers[axis];
  if (numbers.size() == 4) columns.label = numbers[3];
  return columns;
}

bool begins_a_number(std::string_view word) {
  word.remove_prefix(std::min(word.find_first_not_of("+-."), word.size()));
  double value = 0;
  return (!word.empty() && word.front() >= '0' && word.front() <= '9') || parse_number(word, value);
}

std::optional<std::uint64_t> whole_number(const Words& words) {
  std::uint64_t value = 0;
  if (words.size() != 1) return {};
  const auto [end, error] = std::from_chars(words[0].data(), words[0].data() + words[0].size(), value);
  if (error != std::errc{} || end != words[0].data() + words[0].size()) return {};
  return value;
}

// The lines above the points, and the first of a point.
struct Top {
  Words names;  // of the last line without a number
  std::uint64_t names_line = 0;
  Words remark;  // of the last remark that names x, y and z
  std::optional<std::uint64_t> count;
  Words first;  // words of the first point; none: no points
  char delimiter = 0;
  std::uint64_t offset = 0, line = 1;  // of the first point
};

Top read_top(const InputFile& file) {
  std::vector<std::uint8_t> bytes(std::min<std::uint64_t>(kLongest_bytes, file.size()));
  const InputFile::Session session = file.open();
  session.read(0, bytes);
  session.finish();
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const bool whole = bytes.size() == file.size();
  Top top;
  top.offset = text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
  for (; top.offset < text.size(); ++top.line) {
    const std::size_t newline = text.find('\n', top.offset);
    if (newline == text.npos && !whole) break;
    const std::string_view line = text.substr(top.offset, std::min(newline, text.size()) - top.offset);
    if (line.find('\0') != line.npos) file.refuse("found bytes that are no text; expected numbers", top.offset);
    if (line.size() > kLineBytes)
      file.refuse("line " + std::to_string(top.line) + " is longer than " + std::to_string(kLineBytes) + " bytes",
                  top.offset);
    const std::string_view content = Fields::trimmed(line);
    if (is_comment(line)) {
      const std::string_view remark = content.substr(std::min(content.find_first_not_of("#/"), content.size()));
      std::string twice;
      Words words = words_of(remark, delimiter_of(remark));
      if (named_columns(words, twice).complete() && twice.empty()) top.remark = std::move(words);
    } else if (!content.empty()) {
      top.delimiter = delimiter_of(line);
      Words words = words_of(line, top.delimiter);
      const bool numbers = std::any_of(words.begin(), words.end(), begins_a_number);
      if (!numbers && !top.names.empty())
        file.refuse("line " + std::to_string(top.line) + ": found \"" + listed(words) + "\", expected numbers",
                    top.offset);
      const auto count = whole_number(words);
      if (numbers && !(count && !top.count)) {
        top.first = std::move(words);
        return top;
      }
      if (numbers) {
        top.count = count;
      } else {
        top.names = std::move(words);
        top.names_line = top.line;
      }
    }
    top.offset += line.size() + 1;
  }
  if (!whole) file.refuse("found no line of numbers in the first " + std::to_string(kLongest_bytes >> 10) + " KiB");
  top.offset = file.size();
  return top;
}

// What the names in the file say; without names the first columns it is.
Columns stated_columns(const InputFile& file, const Top& top) {
  if (top.names.empty() && top.remark.empty()) return {{0, 1, 2}, {}};
  const bool is_line = !top.names.empty();
  std::string twice;
  const Columns columns = named_columns(is_line ? top.names : top.remark, twice);
  const std::string where = "line " + std::to_string(top.names_line) + ": found the columns \"" + listed(top.names);
  if (!twice.empty()) file.refuse(where + "\", " + twice + " twice; say with --columns 1,2,3 where x, y and z are");
  if (!columns.complete())
    file.refuse(where + "\", expected x, y and z among them; say with --columns 1,2,3 where they are");
  if (is_line && !top.first.empty() && top.first.size() != top.names.size())
    file.refuse("line " + std::to_string(top.line) + ": found " + std::to_string(top.first.size()) +
                    " columns, but names for " + std::to_string(top.names.size()),
                top.offset);
  return columns;
}

}  // namespace

XyzHeader read_xyz_header(const InputFile& file, const std::string& columns) {
  const std::optional<Columns> chosen =
      columns.empty() ? std::nullopt : std::optional<Columns>(chosen_columns(columns));
  const Top top = read_top(file);
  const Columns found = chosen ? *chosen : stated_columns(file, top);
  XyzHeader header;
  header.count = top.count;
  header.lines.offset = top.offset;
  header.lines.line = top.line;
  header.lines.columns = top.first.size();
  header.lines.delimiter = top.delimiter;
  header.lines.comments = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    header.lines.xyz[axis] = *found.xyz[axis];
    if (top.first.empty() || header.lines.xyz[axis] < top.first.size()) continue;
    file.refuse("line " + std::to_string(top.line) + ": found " + std::to_string(top.first.size()) + " columns, " +
                    "xyz"[axis] + " is to be in column " + std::to_string(header.lines.xyz[axis] + 1) +
                    (chosen ? "" : "; expected x y z"),
                top.offset);
  }
  if (found.label && *found.label < top.first.size()) header.class_column = found.label;
  return header;
}

}  // namespace btms
