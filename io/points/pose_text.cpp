#include "io/points/pose_text.h"

#include <array>
#include <charconv>
#include <cmath>

namespace btms {
namespace {

void append(std::string& text, double value, char after) {
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  text.append(digits.data(), end);
  text += after;
}

// x y z w. The largest of the four is taken from the diagonal, the others are divided by it (Shepperd 1978).
std::array<double, 4> quaternion(const std::array<double, 9>& r) {
  const std::array<double, 4> squares = {1 + r[0] - r[4] - r[8], 1 - r[0] + r[4] - r[8], 1 - r[0] - r[4] + r[8],
                                         1 + r[0] + r[4] + r[8]};  // four times those of x y z w
  std::size_t k = 0;
  for (std::size_t i = 1; i < 4; ++i)
    if (squares[i] > squares[k]) k = i;
  const double twice = std::sqrt(squares[k]), d = 2 * twice;
  const double x = (r[7] - r[5]) / d, y = (r[2] - r[6]) / d, z = (r[3] - r[1]) / d;
  const double xy = (r[1] + r[3]) / d, xz = (r[2] + r[6]) / d, yz = (r[5] + r[7]) / d;
  switch (k) {
    case 0:
      return {twice / 2, xy, xz, x};
    case 1:
      return {xy, twice / 2, yz, y};
    case 2:
      return {xz, yz, twice / 2, z};
    default:
      return {x, y, z, twice / 2};
  }
}

}  // namespace

std::string kitti_poses(std::span<const Pose> poses) {
  std::string text;
  for (const Pose& p : poses)
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t k = 0; k < 3; ++k) append(text, p.rotation[3 * row + k], ' ');
      append(text, p.place_m[row], row == 2 ? '\n' : ' ');
    }
  return text;
}

std::string tum_poses(std::span<const Pose> poses, double interval_s) {
  std::string text;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    append(text, static_cast<double>(i) * interval_s, ' ');
    for (const double v : poses[i].place_m) append(text, v, ' ');
    const auto q = quaternion(poses[i].rotation);
    for (std::size_t k = 0; k < 4; ++k) append(text, q[k], k == 3 ? '\n' : ' ');
  }
  return text;
}

}  // namespace btms
