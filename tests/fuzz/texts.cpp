// Texts that people and other programs write: poses, trajectories, calibrations, configurations, coordinate systems.
#include <CLI/CLI.hpp>
#include <cmath>
#include <string>

#include "apps/btms/parameter_options.h"
#include "engine/lattice/coordinates.h"
#include "io/crs/crs.h"
#include "io/crs/crs_units.h"
#include "io/points/pose_files.h"
#include "io/points/pose_text.h"
#include "io/points/trajectory.h"
#include "tests/fuzz/fuzz.h"

namespace btms::fuzz {
namespace {

bool is_within(const Pose& pose) {
  return std::abs(pose.place_m[0]) * 1000 <= static_cast<double>(kMaxHorizontal_mm) &&
         std::abs(pose.place_m[1]) * 1000 <= static_cast<double>(kMaxHorizontal_mm) &&
         std::abs(pose.place_m[2]) * 1000 <= static_cast<double>(kMaxVertical_mm);
}

// A command line that names a configuration file.
struct CommandLine {
  CLI::App app;
  ParameterOptions options;
  explicit CommandLine(const std::string& config) {
    options.add_to(app, "city");
    app.parse(std::vector<std::string>{config, "--config"});  // in reverse, as CLI11 wants them
  }
};

}  // namespace

void poses(Bytes bytes) {
  const auto path = file_of(bytes, ".txt");
  accepted([&] {
    const std::vector<Pose> poses = read_poses(path);
    require(!poses.empty(), "a file of poses has one");
    for (const Pose& pose : poses) {
      require(is_within(pose), "poses lie within the limits");
      for (const double r : pose.rotation) require(std::abs(r) <= 1.001, "rotations have no entry beyond 1");
    }
    const std::string text = kitti_poses(poses);
    const std::vector<Pose> back =
        read_poses(file_of({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, ".poses"));
    require(back.size() == poses.size(), "poses read back as they were written");
    for (std::size_t i = 0; i < back.size(); ++i)
      require(back[i].rotation == poses[i].rotation && back[i].place_m == poses[i].place_m,
              "poses read back as they were written");
  });
  accepted([&] {
    for (const TrajectoryPoint& p : read_trajectory(path))
      require(std::abs(p.x_mm) <= kMaxHorizontal_mm && std::abs(p.y_mm) <= kMaxHorizontal_mm &&
                  std::abs(p.z_mm) <= kMaxVertical_mm,
              "a trajectory lies within the limits");
  });
  accepted([&] { require(is_within(read_calibration(path)), "a calibration lies within the limits"); });
}

void config(Bytes bytes) {
  const std::string path = file_of(bytes, ".yaml").string();  // the same every time
  static const CommandLine line(path);
  accepted(
      [&] {
        const ParameterChoice choice = line.options.resolve();
        check(choice.parameters);
        require(preset(choice.preset).levels >= 1, "the preset is one there is");
      },
      {ErrorCode::kUsage});
}

// What a file's record may say: WKT of any kind, "EPSG:n", or anything else.
void crs(Bytes bytes) {
  const std::string text(bytes.begin(), bytes.end());
  const CrsUnits units = crs_units(text);
  if (units.understood) {
    require(units.horizontal_m >= 1e-6 && units.horizontal_m <= 1e6, "an understood system has a sane unit");
    require(units.vertical_m == 0 || (units.vertical_m >= 1e-6 && units.vertical_m <= 1e6),
            "an understood system has a sane unit of heights, or none");
    if (const std::string metric = crs_in_metres(text); !metric.empty())
      require(crs_units(metric).horizontal_m == 1, "a system in metres is in metres");
  }
  accepted(
      [&] {
        const std::string wkt = describe_crs(text).wkt;
        require(!wkt.empty() && wkt.find('\n') == std::string::npos, "a described system has WKT in one line");
        require(normalise_crs(wkt) == wkt, "WKT that was written is read again as it is");
      },
      {ErrorCode::kUsage, ErrorCode::kBadInput});
}

}  // namespace btms::fuzz
