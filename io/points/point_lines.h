// Random access to the points of a text file, one a line.
#pragma once

#include <array>
#include <functional>
#include <string_view>
#include <vector>

#include "io/points/input_file.h"

namespace btms {

// Longest line of text.
inline constexpr std::size_t kLineBytes = 64 * 1024;

// Where the points are among the lines, and x, y and z among the numbers of a line.
struct LineLayout {
  static constexpr std::uint64_t kAll = UINT64_MAX;

  std::uint64_t offset = 0, line = 1;  // where the lines begin, and the number of the first
  std::uint64_t skip = 0;              // lines before the points
  std::uint64_t points = kAll;         // kAll: as many as there are lines
  std::size_t columns = 0;             // of every line
  std::array<std::size_t, 3> xyz{};
  char delimiter = 0;                                    // see Fields
  bool comments = false;                                 // lines that start with # or // don't count
  std::array<std::string_view, 3> names{"x", "y", "z"};  // for messages
};

// Whether a line is a remark, by its first characters.
bool is_comment(std::string_view line);

// "nan" and "inf" are numbers here; they are dropped later.
bool parse_number(std::string_view word, double& value);

// Remembers where every 1024th line of a point starts. Blank lines don't count. Immutable, thread-safe.
class PointLines {
 public:
  // Throws Error(kBadInput) when there are fewer lines than points, or one is too long.
  PointLines(const InputFile& file, const LineLayout& layout);

  std::uint64_t points() const { return points_; }
  bool trailing() const { return trailing_; }  // lines behind the last point

  // Calls visit(x, y, z in metres) for points [first, first + count) in order.
  void read(const InputFile& file, std::uint64_t first, std::size_t count, std::vector<std::uint8_t>& scratch,
            const std::function<void(const double*)>& visit) const;

 private:
  struct Mark {
    std::uint64_t offset, line;  // in the file, the line counted from 1
  };
  bool counts(std::string_view line) const;
  void parse(const InputFile& file, std::string_view line, std::uint64_t offset, std::uint64_t number,
             double* xyz) const;

  LineLayout layout_;
  std::vector<Mark> marks_;  // of points 0, 1024, ..., and the end
  std::uint64_t points_ = 0;
  bool trailing_ = false;
};

}  // namespace btms
