#include "io/points/pcd_header.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <string_view>

namespace btms {
namespace {

using Words = std::vector<std::string_view>;

constexpr std::uint64_t kMostValues = 65'536;   // COUNT of one field
constexpr std::uint64_t kMostBytes = 1 << 24;   // of a record
constexpr std::size_t kMostHeader = 64 * 1024;  // bytes

Words split(std::string_view line) {
  constexpr std::string_view kBlank = " \t\r";
  Words words;
  for (std::size_t at = 0; (at = line.find_first_not_of(kBlank, at)) != line.npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlank, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

// The header line by line; the entries by their keyword.
class Parser {
 public:
  explicit Parser(const InputFile& file) : file_(file) {}

  PcdHeader parse() {
    read_lines();
    header_.version = entry("VERSION").words.empty() ? "0.7" : std::string(entry("VERSION").words[0]);
    read_fields();
    read_points();
    read_data();
    check_viewpoint();
    return header_;
  }

 private:
  struct Entry {
    std::uint64_t line = 0;
    Words words;
  };

  [[noreturn]] void refuse(const Entry& entry, const std::string& message) const {
    file_.refuse((entry.line == 0 ? std::string() : "line " + std::to_string(entry.line) + ": ") + message);
  }

  const Entry& entry(const std::string& keyword) const {
    static const Entry kNone;
    const auto it = entries_.find(keyword);
    return it == entries_.end() ? kNone : it->second;
  }

  void read_lines() {
    text_.resize(std::min<std::uint64_t>(file_.size(), kMostHeader));
    const InputFile::Session session = file_.open();
    session.read(0, {reinterpret_cast<std::uint8_t*>(text_.data()), text_.size()});
    session.finish();
    if (text_.empty()) file_.refuse("the file is empty; expected a PCD header");
    for (std::size_t at = 0; entries_.find("DATA") == entries_.end();) {
      const std::size_t end = text_.find('\n', at);
      if (end == text_.npos) {
        file_.refuse(
            "no DATA line in the first " + std::to_string(text_.size()) + " bytes; not a PCD file or truncated", at);
      }
      ++header_.data_line;
      Words words = split(std::string_view(text_).substr(at, end - at));
      at = header_.data_offset = end + 1;
      if (words.empty() || words[0].front() == '#') continue;
      const std::string keyword = words[0] == "COLUMNS" ? "FIELDS" : std::string(words[0]);
      words.erase(words.begin());
      if (!entries_.emplace(keyword, Entry{header_.data_line, words}).second)
        refuse({header_.data_line, {}}, keyword + " a second time");
    }
  }

  std::uint64_t number(const Entry& entry, std::string_view word, std::uint64_t least, std::uint64_t most) const {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || value < least || value > most) {
      refuse(entry, "found " + std::string(word.substr(0, 40)) + ", expected a whole number from " +
                        std::to_string(least) + " to " + std::to_string(most));
    }
    return value;
  }

  void read_fields() {
    const Entry &fields = entry("FIELDS"), &sizes = entry("SIZE"), &types = entry("TYPE"), &counts = entry("COUNT");
    const std::size_t n = fields.words.size();
    if (n == 0) refuse(fields, "no FIELDS in the header; expected x, y and z among them");
    const auto check_length = [&](const char* keyword, const Entry& list) {
      if (list.words.size() == n) return;
      refuse(list, std::string(keyword) + " has " + std::to_string(list.words.size()) + " entries, FIELDS " +
                       std::to_string(n));
    };
    check_length("SIZE", sizes);
    check_length("TYPE", types);
    if (counts.line != 0) check_length("COUNT", counts);  // optional: 1 for every field
    std::array<int, 3> seen{};
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint64_t bytes = number(sizes, sizes.words[i], 1, 8);
      const std::uint64_t count = counts.line == 0 ? 1 : number(counts, counts.words[i], 1, kMostValues);
      const std::string_view type = types.words[i];
      if (type != "I" && type != "U" && type != "F")
        refuse(types, "type " + std::string(type) + ", expected I, U or F");
      if ((bytes & (bytes - 1)) != 0 || (type == "F" && bytes < 4))
        refuse(sizes, "type " + std::string(type) + " of " + std::to_string(bytes) +
                          " bytes, expected 1, 2, 4 or 8 (F: 4 or 8)");
      const std::size_t axis = std::string_view("xyz").find(fields.words[i]);
      if (fields.words[i].size() == 1 && axis < 3) {
        ++seen[axis];
        if (type != "F" || count != 1) {
          refuse(types, "field " + std::string(fields.words[i]) + " is " + std::string(type) +
                            std::to_string(8 * bytes) + " x " + std::to_string(count) +
                            ", expected one float32 or float64");
        }
        header_.xyz[axis] = {bytes, header_.stride, header_.columns};
      }
      header_.stride += bytes * count;
      header_.columns += count;
      if (header_.stride > kMostBytes) refuse(counts, "a record of more than " + std::to_string(kMostBytes) + " bytes");
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (seen[axis] != 1)
        refuse(fields, "field " + std::string(1, "xyz"[axis]) + " found " + std::to_string(seen[axis]) +
                           " times, expected once");
  }

  std::uint64_t count_of(const std::string& keyword) const {
    const Entry& e = entry(keyword);
    if (e.words.size() != 1) refuse(e, keyword + " with " + std::to_string(e.words.size()) + " numbers, expected one");
    return number(e, e.words[0], 0, UINT64_MAX / 2);
  }

  void read_points() {
    const std::uint64_t width = count_of("WIDTH"), height = entry("HEIGHT").line == 0 ? 1 : count_of("HEIGHT");
    const std::string product = "WIDTH " + std::to_string(width) + " x HEIGHT " + std::to_string(height);
    if (__builtin_mul_overflow(width, height, &header_.points)) refuse(entry("WIDTH"), product + " overflows");
    if (entry("POINTS").line == 0) return;
    const std::uint64_t stated = count_of("POINTS");
    if (stated != header_.points) refuse(entry("POINTS"), "POINTS " + std::to_string(stated) + ", but " + product);
  }

  void read_data() {
    const Entry& data = entry("DATA");
    const std::string kind = data.words.size() == 1 ? std::string(data.words[0]) : std::string();
    if (kind == "ascii")
      header_.data = PcdData::kAscii;
    else if (kind == "binary")
      header_.data = PcdData::kBinary;
    else if (kind == "binary_compressed")
      header_.data = PcdData::kCompressed;
    else
      refuse(data, "DATA \"" + kind + "\", expected ascii, binary or binary_compressed");
  }

  void check_viewpoint() {
    const Entry& viewpoint = entry("VIEWPOINT");
    if (viewpoint.line != 0 && viewpoint.words.size() != 7)
      header_.warnings.push_back("VIEWPOINT has " + std::to_string(viewpoint.words.size()) +
                                 " numbers, expected 7: ignored");
  }

  const InputFile& file_;
  std::string text_;
  std::map<std::string, Entry> entries_;
  PcdHeader header_;
};

}  // namespace

PcdHeader read_pcd_header(const InputFile& file) { return Parser(file).parse(); }

}  // namespace btms
