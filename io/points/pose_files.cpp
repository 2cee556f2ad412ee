#include "io/points/pose_files.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"
#include "io/files/read_file.h"
#include "io/points/number_lines.h"

namespace btms {
namespace {

constexpr double kSkew = 1e-3;  // of a printed rotation; files have six digits or more
constexpr std::uint64_t kCalibration_bytes = std::uint64_t{1} << 20;

bool is_rotation(const std::array<double, 9>& r) {
  const auto dot = [&](std::size_t a, std::size_t b) {
    return r[3 * a] * r[3 * b] + r[3 * a + 1] * r[3 * b + 1] + r[3 * a + 2] * r[3 * b + 2];
  };
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b <= a; ++b)
      if (!(std::abs(dot(a, b) - (a == b ? 1 : 0)) < kSkew)) return false;
  const double determinant =
      r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) + r[2] * (r[3] * r[7] - r[4] * r[6]);
  return determinant > 0;  // else a mirror
}

Pose from_matrix(std::span<const double> v) {
  return {{v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10]}, {v[3], v[7], v[11]}};
}

Pose from_quaternion(std::span<const double> v) {
  const double largest = std::max({std::abs(v[4]), std::abs(v[5]), std::abs(v[6]), std::abs(v[7])});
  double x = v[4] / largest, y = v[5] / largest, z = v[6] / largest, w = v[7] / largest;  // else squares overflow
  const double length = std::sqrt(x * x + y * y + z * z + w * w);
  x /= length, y /= length, z /= length, w /= length;
  return {
      {1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), 2 * (x * y + z * w), 1 - 2 * (x * x + z * z),
       2 * (y * z - x * w), 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)},
      {v[1], v[2], v[3]}};
}

// Empty where there is nothing to object to.
std::string complaint(const Pose& pose) {
  if (!is_rotation(pose.rotation))
    return "found no rotation: its axes are not of length 1, right-angled and right-handed";
  const auto within = [](double m, std::int64_t limit_mm) {
    return std::abs(m) * 1000 <= static_cast<double>(limit_mm);
  };
  if (!within(pose.place_m[0], kMaxHorizontal_mm) || !within(pose.place_m[1], kMaxHorizontal_mm) ||
      !within(pose.place_m[2], kMaxVertical_mm))
    return "the pose is not finite, or too far out for a map";
  return {};
}

}  // namespace

std::vector<Pose> read_poses(const std::filesystem::path& file) {
  std::vector<Pose> poses;
  read_number_lines(file, "pose", [&](std::size_t line, std::span<const double> values) {
    std::string wrong = "found " + std::to_string(values.size()) + " numbers, expected 12 (KITTI) or 8 (TUM)";
    if (values.size() == 12 || values.size() == 8) {
      poses.push_back(values.size() == 12 ? from_matrix(values) : from_quaternion(values));
      wrong = complaint(poses.back());
    }
    if (!wrong.empty()) throw Error(ErrorCode::kBadInput, "line " + std::to_string(line) + ": " + wrong, file.string());
  });
  return poses;
}

Pose read_calibration(const std::filesystem::path& file) {
  const std::vector<std::uint8_t> bytes = read_file(file, kCalibration_bytes, ErrorCode::kUsage);
  std::istringstream text(std::string(bytes.begin(), bytes.end()));
  for (std::string line; std::getline(text, line);) {
    if (!line.starts_with("Tr:") && !line.starts_with("Tr_velo_to_cam:")) continue;
    std::vector<double> values;
    if (!parse_numbers(std::string_view(line).substr(line.find(':') + 1), values))
      throw Error(ErrorCode::kBadInput, "the line Tr: has a word that is no number", file.string());
    if (values.size() != 12)
      throw Error(ErrorCode::kBadInput, "the line Tr: has " + std::to_string(values.size()) + " numbers, expected 12",
                  file.string());
    const Pose pose = from_matrix(values);
    if (const std::string wrong = complaint(pose); !wrong.empty())
      throw Error(ErrorCode::kBadInput, "the line Tr: " + wrong, file.string());
    return pose;
  }
  throw Error(ErrorCode::kBadInput, "there is no line Tr: in it", file.string());
}

}  // namespace btms
