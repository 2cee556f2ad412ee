// Numbers and tables as people read them, and the facts about this process that reports end with.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace btms {

using Json = nlohmann::ordered_json;

std::string grouped(std::uint64_t n);                         // "2 000 000"
std::string counted(std::uint64_t n, std::string_view noun);  // "1 file", "2 files"
std::string rounded(double n);                                // "3.2 M"
std::string bytes_text(std::uint64_t n);                      // "812 MB"
std::string seconds_text(double s);                           // "0.042 s"
std::string percent_text(double share);                       // "97.31"

// Columns of equal width on stdout: the first to the left, the others to the right unless `left` says so.
class TextTable {
 public:
  enum class Align { kLeft, kNumbers };
  explicit TextTable(Align align = Align::kNumbers) : align_(align) {}
  void row(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  void print() const;

 private:
  Align align_;
  std::vector<std::vector<std::string>> rows_;
};

// Text and a newline to stdout; throws Error(kFailed) when stdout is closed or full.
void print_line(std::string_view text);
// To a millionth: finer digits are the dust of binary fractions.
double tidy(double n);
// The one JSON object of a subcommand.
void print_json(const Json& object);

std::uint64_t rss_bytes();       // of this process, now
std::uint64_t peak_rss_bytes();  // highest of this process and of every process it forked

}  // namespace btms
