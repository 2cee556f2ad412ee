#include "io/points/trajectory.h"

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"
#include "io/files/read_file.h"

namespace btms {
namespace {

constexpr std::uint64_t kLimit_bytes = std::uint64_t{1} << 30;

std::vector<double> numbers(std::string_view line) {
  std::vector<double> out;
  const char *at = line.data(), *end = at + line.size();
  while (true) {
    while (at < end && (*at == ' ' || *at == '\t' || *at == ',' || *at == '\r')) ++at;
    if (at == end) return out;
    double value = 0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc{}) return {};
    out.push_back(value);
    at = next;
  }
}

}  // namespace

std::vector<TrajectoryPoint> read_trajectory(const std::filesystem::path& file) {
  const std::vector<std::uint8_t> bytes = read_file(file, kLimit_bytes, ErrorCode::kUsage);
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::vector<TrajectoryPoint> out;
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos || line[first] == '#') continue;
    const auto refuse = [&](const std::string& what) {
      throw Error(ErrorCode::kBadInput, "line " + std::to_string(line_number) + ": " + what, file.string());
    };
    const std::vector<double> v = numbers(line);
    double x = 0, y = 0, z = 0;
    if (v.size() == 3)
      x = v[0], y = v[1], z = v[2];
    else if (v.size() == 8)
      x = v[1], y = v[2], z = v[3];
    else if (v.size() == 12)
      x = v[3], y = v[7], z = v[11];
    else
      refuse("expected 3 numbers (x y z), 8 (TUM) or 12 (KITTI)");
    if (!(std::abs(x) * 1000 <= static_cast<double>(kMaxHorizontal_mm)) ||
        !(std::abs(y) * 1000 <= static_cast<double>(kMaxHorizontal_mm)) ||
        !(std::abs(z) * 1000 <= static_cast<double>(kMaxVertical_mm)))
      refuse("the pose is not finite, or too far out for a map");
    out.push_back({static_cast<std::int64_t>(std::floor(x * 1000 + 0.5)),
                   static_cast<std::int64_t>(std::floor(y * 1000 + 0.5)),
                   static_cast<std::int32_t>(std::floor(z * 1000 + 0.5))});
  }
  if (out.empty()) throw Error(ErrorCode::kBadInput, "there is no pose in it", file.string());
  return out;
}

}  // namespace btms
