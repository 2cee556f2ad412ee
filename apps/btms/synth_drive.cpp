#include "apps/btms/synth_drive.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <set>

#include "apps/btms/number_range.h"
#include "apps/btms/outputs.h"
#include "apps/btms/report.h"
#include "apps/btms/stop_signal.h"
#include "engine/error.h"
#include "engine/tiling/spill.h"
#include "io/files/atomic_file.h"
#include "io/points/little_endian.h"
#include "io/points/pose_text.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

constexpr double kTogether_m = 10;   // of path, whose scans share what is around them
constexpr double kInterval_s = 0.1;  // between scans
constexpr std::uint64_t kPoint_bytes = 20;

struct Layout {
  fs::path folder;
  fs::path scan(std::size_t i) const { return folder / "velodyne" / fmt::format("{:06}.bin", i); }
  fs::path labels(std::size_t i) const { return folder / "labels" / fmt::format("{:06}.label", i); }
};

constexpr const char* kTextFiles[] = {"calib.txt", "times.txt", "poses.txt", "poses_drifting.txt", "trajectory.txt"};

void write_scan(const Layout& layout, std::size_t i, const std::vector<DrivePoint>& points) {
  std::vector<std::uint8_t> bytes(points.size() * 16), labels(points.size() * 4);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const DrivePoint& p = points[k];
    const std::array<float, 4> record{p.x_m, p.y_m, p.z_m, p.intensity};
    store(&bytes[16 * k], record);
    store(&labels[4 * k], p.label);
  }
  write_file(layout.scan(i), bytes);
  write_file(layout.labels(i), labels);
}

// Fewer scans than those that are replaced would leave some behind that belong to no pose.
void refuse_leftovers(const fs::path& folder, const std::set<std::string>& names) {
  if (!fs::is_directory(folder)) return;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (const std::string name = entry.path().filename().string(); !is_temporary_name(name) && !names.contains(name))
      throw Error(ErrorCode::kUsage, "is no part of this drive; choose another output folder, or remove what is there",
                  entry.path().string());
}

void prepare(const Layout& layout, std::size_t scans, std::uint64_t bytes, bool force) {
  std::vector<fs::path> paths;
  std::set<std::string> points, labels;
  for (const char* name : kTextFiles) paths.push_back(layout.folder / name);
  for (std::size_t i = 0; i < scans; ++i) {
    paths.push_back(layout.scan(i));
    paths.push_back(layout.labels(i));
    points.insert(layout.scan(i).filename().string());
    labels.insert(layout.labels(i).filename().string());
  }
  refuse_existing(paths, force);
  refuse_leftovers(layout.folder / "velodyne", points);
  refuse_leftovers(layout.folder / "labels", labels);
  require_disk(layout.folder, bytes, "or choose another output folder");
  for (const char* name : {"velodyne", "labels"}) make_folders(layout.folder / name);
}

void write_poses(const Layout& layout, const Drive& drive) {
  std::string times;
  for (std::size_t i = 0; i < drive.poses().size(); ++i)
    times += fmt::format("{:.1f}\n", static_cast<double>(i) * kInterval_s);
  write_file(layout.folder / "times.txt", times);
  write_file(layout.folder / "calib.txt", "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n");
  write_file(layout.folder / "trajectory.txt", tum_poses(drive.poses(), kInterval_s));
  write_file(layout.folder / "poses_drifting.txt", kitti_poses(drive.drifting_poses()));
  write_file(layout.folder / "poses.txt", kitti_poses(drive.poses()));
}

// What names the scene for `btms eval --map`.
std::string scene_flags(const SceneArguments& a) {
  std::string text = fmt::format("--scene {} --seed {} --points {}", a.scene.name, a.scene.seed, a.scene.points);
  if (a.scene.density_per_m2) text += fmt::format(" --density {}", *a.scene.density_per_m2);
  if (a.origin != "0,0") text += " --origin " + a.origin;
  return text;
}

void print_drive(const SceneArguments& arguments, const Layout& layout, const Drive& drive, std::uint64_t points,
                 double seconds, bool as_json) {
  const std::size_t scans = drive.poses().size();
  const Pose &end = drive.poses().back(), &strayed = drive.drifting_poses().back();
  const double drift = strayed.place_m[2] - end.place_m[2];
  if (as_json)
    return print_json({{"scene", arguments.scene.name},
                       {"seed", arguments.scene.seed},
                       {"scans", scans},
                       {"points", points},
                       {"drift_m", tidy(drift)},
                       {"folder", layout.folder.string()},
                       {"scene_flags", scene_flags(arguments)},
                       {"seconds", tidy(seconds)}});
  print_line(fmt::format("{}  {} of {} points each", (layout.folder / "velodyne").string(), counted(scans, "scan"),
                         grouped(points / scans)));
  print_line(fmt::format("{}  of the sensor in the map frame; trajectory.txt holds the same for `build --trajectory`",
                         (layout.folder / "poses.txt").string()));
  print_line(fmt::format("{}  strayed by {:.2f} m in height at the end",
                         (layout.folder / "poses_drifting.txt").string(), drift));
  print_line(fmt::format("{} points in {}; the truth: btms eval --map MAP {}", grouped(points), seconds_text(seconds),
                         scene_flags(arguments)));
}

}  // namespace

CLI::Option* add_drive_options(CLI::App& app, DriveArguments& arguments) {
  const char* group = "A drive";
  DriveOptions& o = arguments.options;
  CLI::Option* drive =
      app.add_flag("--drive", arguments.drive, "Drive a spinning scanner through the scene: scans instead of tiles")
          ->group(group);
  const auto add = [&](const char* name, auto& value, const char* help, const CLI::Validator& range, const char* type) {
    app.add_option(name, value, help)->check(range)->needs(drive)->type_name(type)->group(group);
  };
  add("--scans", o.scans, "Scans to make", CLI::Range(std::size_t{1}, std::size_t{1'000'000}), "N");
  add("--beams", o.beams, "Beams of the scanner", CLI::Range(1, 1024), "N");
  add("--azimuths", o.azimuths, "Rays of a beam, a turn", CLI::Range(4, 16'384), "N");
  app.add_option("--field-of-view", arguments.field_of_view_deg,
                 "Highest and lowest beam, in degrees above the horizon")
      ->delimiter(',')
      ->expected(2)
      ->check(number_range(-89.0, 89.0))
      ->needs(drive)
      ->type_name("UP,DOWN")
      ->group(group);
  add("--range", o.range_m, "As far as the scanner sees, in metres", number_range(1.0, 300.0), "D");
  add("--noise", o.noise_m, "Of ranges, in metres, 1 sigma", number_range(0.0, 1.0), "D");
  add("--step", o.step_m, "From scan to scan along the path, in metres", number_range(0.01, 100.0), "D");
  add("--sensor-height", o.sensor_height_m, "Above the ground, in metres", number_range(0.3, 5.0), "H");
  add("--drift", o.drift_deg,
      "Degrees by which roll and pitch of poses_drifting.txt stray; the height follows the pitch",
      number_range(0.0, 10.0), "A");
  return drive;
}

int run_drive(const SceneArguments& scene, const DriveArguments& arguments, const std::string& folder, bool force,
              const CommonOptions& common) {
  DriveOptions options = arguments.options;
  options.up_deg = arguments.field_of_view_deg[0];
  options.down_deg = arguments.field_of_view_deg[1];
  if (options.down_deg > options.up_deg)
    throw Error(ErrorCode::kUsage, "--field-of-view: expected UP,DOWN with the highest beam first");
  const Layout layout{folder};
  const std::uint64_t rays = static_cast<std::uint64_t>(options.beams) * static_cast<std::uint64_t>(options.azimuths);
  const Drive drive(scene.options(), options);  // first, so that nothing is made where it refuses
  prepare(layout, options.scans, options.scans * rays * kPoint_bytes, force);

  watch_stop_signals();
  const auto threads = make_threads(common.thread_count());
  ProgressDisplay progress(common.progress_style());
  progress.begin("drive", options.scans, "scans");
  const auto begun = std::chrono::steady_clock::now();
  std::atomic<std::uint64_t> points = 0;
  const auto together = static_cast<std::size_t>(std::clamp(kTogether_m / options.step_m, 1.0, 32.0));
  threads->for_each((options.scans + together - 1) / together, [&](std::size_t batch, int) {
    throw_if_stopped();
    const std::size_t first = batch * together, last = std::min(options.scans, first + together);
    std::vector<std::vector<DrivePoint>> scans(last - first);
    drive.scan(first, last, scans);
    for (std::size_t i = first; i < last; ++i) {
      throw_if_stopped();
      write_scan(layout, i, scans[i - first]);
      points += scans[i - first].size();
      progress.advance(1);
    }
  });
  write_poses(layout, drive);
  progress.finish();
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begun;
  print_drive(scene, layout, drive, points, seconds.count(), common.json);
  return 0;
}

}  // namespace btms
