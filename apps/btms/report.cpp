#include "apps/btms/report.h"

#include <spdlog/fmt/fmt.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "engine/error.h"

namespace btms {
namespace {

// Characters, not bytes, so that Greek symbols don't shift columns.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

std::string scaled(double n, std::string_view space) {
  constexpr std::string_view kPrefixes[] = {"", "k", "M", "G", "T"};
  std::size_t i = 0;
  while (n >= 999.5 && i + 1 < std::size(kPrefixes)) n /= 1000, ++i;
  const int digits = i == 0 || n >= 99.5 ? 0 : n >= 9.95 ? 1 : 2;
  return fmt::format("{:.{}f}{}{}", n, digits, i == 0 && space.empty() ? "" : " ", kPrefixes[i]);
}

}  // namespace

std::string grouped(std::uint64_t n) {
  const std::string digits = std::to_string(n);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += ' ';
    text += digits[i];
  }
  return text;
}

std::string counted(std::uint64_t n, std::string_view noun) {
  return fmt::format("{} {}{}", grouped(n), noun, n == 1 ? "" : "s");
}

std::string rounded(double n) { return scaled(n, ""); }
std::string bytes_text(std::uint64_t n) { return scaled(static_cast<double>(n), " ") + "B"; }
std::string seconds_text(double s) { return fmt::format("{:.3f} s", s); }
std::string percent_text(double share) { return fmt::format("{:.2f}", 100 * share); }

void TextTable::print() const {
  std::vector<std::size_t> widths;
  for (const auto& row : rows_) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], width(row[c]));
  }
  for (const auto& row : rows_) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string pad(widths[c] - width(row[c]), ' ');
      if (c > 0) line += "  ";
      line += c == 0 || align_ == Align::kLeft ? row[c] + pad : pad + row[c];
    }
    line.erase(line.find_last_not_of(' ') + 1);
    print_line(line);
  }
}

void print_line(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fputc('\n', stdout) == EOF)
    throw Error(ErrorCode::kFailed, "cannot write to stdout");
}

double tidy(double n) { return std::round(n * 1e6) / 1e6 + 0.0; }  // and no -0

void print_json(const Json& object) {
  // A file name may be any bytes: what is not UTF-8 is replaced rather than refused.
  print_line(object.dump(2, ' ', false, Json::error_handler_t::replace));
}

std::uint64_t rss_bytes() {
  std::uint64_t size = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> size >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

std::uint64_t peak_rss_bytes() {
  rusage self{}, children{};
  getrusage(RUSAGE_SELF, &self);
  getrusage(RUSAGE_CHILDREN, &children);
  return static_cast<std::uint64_t>(std::max(self.ru_maxrss, children.ru_maxrss)) * 1024;
}

}  // namespace btms
