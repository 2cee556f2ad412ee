#include "io/points/point_lines.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <string>
#include <string_view>

#include "io/points/fields.h"

namespace btms {
namespace {

constexpr std::uint64_t kSpacing = 1024;
constexpr std::size_t kBlock = std::size_t{1} << 18;  // more than a line
static_assert(kBlock > kLineBytes);

// Calls visit(line, offset, number) until it returns false or the range ends.
template <typename Visit>
void for_each_line(const InputFile& file, std::uint64_t at, std::uint64_t end, std::uint64_t number,
                   std::vector<std::uint8_t>& buffer, Visit visit) {
  const InputFile::Session session = file.open();
  if (buffer.size() < kBlock) buffer.resize(kBlock);
  while (at < end) {
    const std::size_t n = std::min<std::uint64_t>(kBlock, end - at);
    session.read(at, {buffer.data(), n});
    const std::string_view text(reinterpret_cast<const char*>(buffer.data()), n);
    std::size_t begin = 0;
    while (begin < n) {
      std::size_t newline = text.find('\n', begin);
      const bool last = at + n == end;
      if (newline == text.npos && !last && begin != 0) break;  // cut by the block: read again from its start
      if (newline == text.npos) newline = n;
      if (newline - begin > kLineBytes) {
        file.refuse("line " + std::to_string(number) + " is longer than " + std::to_string(kLineBytes) + " bytes",
                    at + begin);
      }
      if (!visit(text.substr(begin, newline - begin), at + begin, number)) return session.finish();
      begin = newline + 1;
      ++number;
    }
    at += std::min(begin, n);
  }
  session.finish();
}

}  // namespace

bool is_comment(std::string_view line) {
  const std::string_view text = Fields::trimmed(line);
  return text.starts_with('#') || text.starts_with("//");
}

bool parse_number(std::string_view word, double& value) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size()) return false;
  if (error == std::errc::result_out_of_range)
    value = std::strtod(std::string(word).c_str(), nullptr);  // 0 or infinite
  return error != std::errc::invalid_argument;
}

bool PointLines::counts(std::string_view line) const {
  return !Fields::trimmed(line).empty() && !(layout_.comments && is_comment(line));
}

void PointLines::parse(const InputFile& file, std::string_view line, std::uint64_t offset, std::uint64_t number,
                       double* xyz) const {
  std::size_t column = 0;
  std::string_view word;
  for (Fields fields(line, layout_.delimiter); fields.next(word); ++column) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (layout_.xyz[axis] != column || parse_number(word, xyz[axis])) continue;
      const bool comma = word.find(layout_.delimiter == ',' ? ' ' : ',') != word.npos;
      file.refuse("line " + std::to_string(number) + ": found \"" + std::string(word.substr(0, 40)) +
                      "\", expected a number for " + std::string(layout_.names[axis]) +
                      (comma ? "; decimals are written with a point, not with a comma" : ""),
                  offset + static_cast<std::size_t>(word.data() - line.data()));
    }
  }
  if (column == layout_.columns) return;
  file.refuse("line " + std::to_string(number) + ": found " + std::to_string(column) + " numbers, expected " +
                  std::to_string(layout_.columns),
              offset);
}

PointLines::PointLines(const InputFile& file, const LineLayout& layout) : layout_(layout) {
  std::vector<std::uint8_t> buffer;
  std::uint64_t skipped = 0;
  Mark end{layout.offset, layout.line};
  for_each_line(file, layout.offset, file.size(), layout.line, buffer,
                [&](std::string_view line, std::uint64_t offset, std::uint64_t number) {
                  if (!counts(line)) return true;
                  if (skipped < layout.skip) return ++skipped, true;
                  trailing_ = points_ == layout.points;
                  if (trailing_) return false;
                  if (points_++ % kSpacing == 0) marks_.push_back({offset, number});
                  end = {std::min(offset + line.size() + 1, file.size()), number + 1};
                  return true;
                });
  marks_.push_back(end);
  if (layout.points != LineLayout::kAll && points_ < layout.points) {
    file.refuse("header declares " + std::to_string(layout.points) + " points, found " + std::to_string(points_) +
                    " lines; the file is truncated",
                layout.offset);
  }
}

void PointLines::read(const InputFile& file, std::uint64_t first, std::size_t count, std::vector<std::uint8_t>& scratch,
                      const std::function<void(const double*)>& visit) const {
  if (count == 0) return;
  const Mark& start = marks_[first / kSpacing];
  std::uint64_t point = first - first % kSpacing;
  const std::uint64_t end = first + count;
  for_each_line(file, start.offset, marks_.back().offset, start.line, scratch,
                [&](std::string_view line, std::uint64_t offset, std::uint64_t number) {
                  if (!counts(line)) return true;
                  if (point >= first) {
                    double xyz[3];
                    parse(file, line, offset, number, xyz);
                    visit(xyz);
                  }
                  return ++point < end;
                });
  if (point != end) file.refuse("changed while read: lines are missing", marks_.back().offset);
}

}  // namespace btms
