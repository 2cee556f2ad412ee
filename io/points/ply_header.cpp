#include "io/points/ply_header.h"

#include <algorithm>
#include <charconv>
#include <string_view>
#include <utility>

namespace btms {
namespace {

using Words = std::vector<std::string_view>;

constexpr std::size_t kMostHeader = 64 * 1024, kMostLine = 4096;  // bytes
constexpr std::size_t kMostProperties = 65'536;                   // keeps a record below 2^24 bytes

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

class Parser {
 public:
  explicit Parser(const InputFile& file) : file_(file), text_(std::min<std::uint64_t>(file.size(), kMostHeader), '\0') {
    const InputFile::Session session = file_.open();
    session.read(0, {reinterpret_cast<std::uint8_t*>(text_.data()), text_.size()});
    session.finish();
  }

  PlyHeader parse() {
    if (text_.empty()) file_.refuse("the file is empty; expected a PLY header");
    if (split(next_line()) != Words{"ply"}) file_.refuse("not a PLY file: expected its first line to be \"ply\"", 0);
    bool has_format = false;
    while (true) {
      const Words words = split(next_line());
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "end_header") break;
      if (words[0] == "format")
        has_format = (read_format(words), true);
      else if (words[0] == "element")
        read_element(words);
      else if (words[0] == "property")
        read_property(words);
      else
        refuse("found \"" + shown(words[0]) + "\", expected format, element, property, comment or end_header");
    }
    if (!has_format) file_.refuse("no format line in the PLY header");
    header_.data_offset = at_;
    find_points();
    return std::move(header_);
  }

 private:
  static std::string shown(std::string_view word) { return std::string(word.substr(0, 40)); }
  [[noreturn]] void refuse(const std::string& message) const { refuse(header_.lines, message); }
  [[noreturn]] void refuse(std::uint64_t line, const std::string& message) const {
    file_.refuse("line " + std::to_string(line) + ": " + message);
  }

  std::string_view next_line() {
    ++header_.lines;
    const std::size_t end = text_.find('\n', at_);
    if (std::min(end, text_.size()) - at_ > kMostLine)
      file_.refuse("line " + std::to_string(header_.lines) + " is longer than " + std::to_string(kMostLine) + " bytes",
                   at_);
    if (end == text_.npos) {
      file_.refuse(
          "no end_header in the first " + std::to_string(text_.size()) + " bytes; not a PLY file, or truncated", at_);
    }
    return std::string_view(text_).substr(std::exchange(at_, end + 1), end - at_);
  }

  void read_format(const Words& words) {
    constexpr std::string_view kNames[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    const auto* const name = std::find(std::begin(kNames), std::end(kNames), words.size() == 3 ? words[1] : "");
    if (name == std::end(kNames) || words[2] != "1.0") {
      refuse(
          "the format is not known; expected \"ascii\", \"binary_little_endian\" or \"binary_big_endian\", and "
          "\"1.0\"");
    }
    header_.data = static_cast<PlyData>(name - kNames);
  }

  void read_element(const Words& words) {
    if (words.size() != 3) refuse("expected \"element NAME COUNT\"");
    PlyElement element;
    element.name = words[1];
    element.line = header_.lines;
    const char* const end = words[2].data() + words[2].size();
    const auto [stop, error] = std::from_chars(words[2].data(), end, element.count);
    if (error != std::errc() || stop != end || element.count > UINT64_MAX / 2) {
      refuse("found " + shown(words[2]) + " of " + shown(words[1]) + ", expected a whole number from 0 to " +
             std::to_string(UINT64_MAX / 2));
    }
    header_.elements.push_back(std::move(element));
  }

  NumberType type(std::string_view name) const {
    constexpr std::string_view kNames[] = {"char", "uchar", "short", "ushort", "int", "uint", "float", "double"};
    constexpr std::string_view kNewer[] = {"int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"};
    for (std::size_t i = 0; i < std::size(kNames); ++i)
      if (name == kNames[i] || name == kNewer[i]) return static_cast<NumberType>(i);
    refuse("type " + shown(name) +
           " is not known; expected char, uchar, short, ushort, int, uint, float, double, or int8 to float64");
  }

  void read_property(const Words& words) {
    if (header_.elements.empty()) refuse("a property before the first element");
    PlyProperty property;
    const bool list = words.size() > 1 && words[1] == "list";
    if (words.size() != (list ? 5U : 3U)) refuse("expected \"property TYPE NAME\" or \"property list TYPE TYPE NAME\"");
    if (list) {
      property.list_count = type(words[2]);
      if (*property.list_count >= NumberType::kFloat32) refuse("the length of a list is no whole number");
    }
    property.type = type(words[words.size() - 2]);
    property.name = words.back();
    if (++properties_ > kMostProperties) refuse("more than " + std::to_string(kMostProperties) + " properties");
    header_.elements.back().properties.push_back(std::move(property));
  }

  void find_points() {
    const auto is_vertex = [](const PlyElement& e) { return e.name == "vertex"; };
    const auto found = std::count_if(header_.elements.begin(), header_.elements.end(), is_vertex);
    if (found != 1)
      file_.refuse("the header has " + std::to_string(found) + " elements called vertex, expected one: the points");
    header_.vertex = static_cast<std::size_t>(
        std::find_if(header_.elements.begin(), header_.elements.end(), is_vertex) - header_.elements.begin());
    std::array<int, 3> seen{};
    std::uint64_t offset = 0;
    for (std::size_t i = 0; i < header_.points().properties.size(); ++i) {
      const PlyProperty& property = header_.points().properties[i];
      if (property.list_count)
        refuse(header_.points().line, "vertex has a list (" + shown(property.name) + "), expected numbers only");
      const std::size_t axis = property.name.size() == 1 ? std::string_view("xyz").find(property.name) : 3;
      if (axis < 3) {
        ++seen[axis];
        header_.xyz[axis] = {i, offset, property.type};
      }
      offset += bytes_of(property.type);
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (seen[axis] != 1)
        refuse(header_.points().line, "vertex has the property " + std::string(1, "xyz"[axis]) + " " +
                                          std::to_string(seen[axis]) + " times, expected once");
  }

  const InputFile& file_;
  std::string text_;
  std::size_t at_ = 0, properties_ = 0;
  PlyHeader header_;
};

}  // namespace

bool PlyElement::has_lists() const {
  return std::any_of(properties.begin(), properties.end(), [](const PlyProperty& p) { return p.list_count; });
}

std::uint64_t PlyElement::stride() const {
  std::uint64_t bytes = 0;
  for (const PlyProperty& property : properties) bytes += bytes_of(property.type);
  return bytes;
}

PlyHeader read_ply_header(const InputFile& file) { return Parser(file).parse(); }

}  // namespace btms
