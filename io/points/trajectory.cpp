#include "io/points/trajectory.h"

#include <cmath>
#include <string>

#include "engine/error.h"
#include "engine/lattice/coordinates.h"
#include "io/points/number_lines.h"

namespace btms {

std::vector<TrajectoryPoint> read_trajectory(const std::filesystem::path& file) {
  std::vector<TrajectoryPoint> out;
  read_number_lines(file, "pose", [&](std::size_t line, std::span<const double> v) {
    const auto refuse = [&](const std::string& what) {
      throw Error(ErrorCode::kBadInput, "line " + std::to_string(line) + ": " + what, file.string());
    };
    double x = 0, y = 0, z = 0;
    if (v.size() == 3)
      x = v[0], y = v[1], z = v[2];
    else if (v.size() == 8)
      x = v[1], y = v[2], z = v[3];
    else if (v.size() == 12)
      x = v[3], y = v[7], z = v[11];
    else
      refuse("found " + std::to_string(v.size()) + " numbers, expected 3 (x y z), 8 (TUM) or 12 (KITTI)");
    if (!(std::abs(x) * 1000 <= static_cast<double>(kMaxHorizontal_mm)) ||
        !(std::abs(y) * 1000 <= static_cast<double>(kMaxHorizontal_mm)) ||
        !(std::abs(z) * 1000 <= static_cast<double>(kMaxVertical_mm)))
      refuse("the pose is not finite, or too far out for a map");
    out.push_back({static_cast<std::int64_t>(std::floor(x * 1000 + 0.5)),
                   static_cast<std::int64_t>(std::floor(y * 1000 + 0.5)),
                   static_cast<std::int32_t>(std::floor(z * 1000 + 0.5))});
  });
  return out;
}

}  // namespace btms
