// btms synth: synthetic worlds with exact truth, as classified LAS tiles or as scans of a drive through them.
#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <filesystem>

#include "apps/btms/command.h"
#include "apps/btms/outputs.h"
#include "apps/btms/reference_system.h"
#include "apps/btms/scene_options.h"
#include "apps/btms/stop_signal.h"
#include "apps/btms/synth_drive.h"
#include "engine/error.h"
#include "io/files/atomic_file.h"
#include "io/points/las_writer.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

struct SynthCommand {
  CommonOptions common;
  SceneArguments arguments;
  DriveArguments drive;
  std::string crs, output;
  std::size_t files = 0;  // 0: as many as keep a file below kFilePoints
  int point_format = 6;
  bool force = false;
  CLI::Option* points_option = nullptr;
};

// A block of the city fits into the area of so many.
constexpr std::uint64_t kDrivePoints = 2'000'000;

constexpr std::uint64_t kFilePoints = 25'000'000;

struct WrittenFile {
  fs::path path;
  std::uint64_t points = 0;
};

// Point format 0 has no room for the classes of users.
std::uint8_t stored_class(SceneClass label, int point_format) {
  const auto stored = static_cast<std::uint8_t>(label);
  return point_format == 0 && stored > 31 ? static_cast<std::uint8_t>(SceneClass::kUnclassified) : stored;
}

// Consecutive blocks [first, last) of the scene into one file. Blocks are generated in parallel, a few per thread at a
// time, and written in their order, so the file's bytes don't depend on the threads and memory stays bounded.
std::uint64_t write_blocks(const Scene& scene, std::size_t first, std::size_t last, int point_format, LasWriter& writer,
                           const Threads& threads, Progress& progress) {
  const auto window = static_cast<std::size_t>(4 * threads.count());
  std::vector<std::vector<ScenePoint>> blocks(window);
  std::vector<LasPoint> records;
  std::uint64_t points = 0;
  for (std::size_t begin = first; begin < last; begin += window) {
    throw_if_stopped();
    const std::size_t n = std::min(window, last - begin);
    threads.for_each(n, [&](std::size_t i, int) {
      blocks[i].clear();
      scene.generate(begin + i, blocks[i]);
    });
    for (std::size_t i = 0; i < n; ++i) {
      records.clear();
      for (const ScenePoint& p : blocks[i])
        records.push_back({p.x_mm, p.y_mm, p.z_mm, stored_class(p.label, point_format), 0});
      writer.append(records);
      points += records.size();
      progress.advance(records.size());
    }
  }
  return points;
}

void print_synth(const SynthCommand& command, const Scene& scene, const std::vector<WrittenFile>& files,
                 double seconds) {
  std::uint64_t points = 0;
  for (const WrittenFile& file : files) points += file.points;
  if (command.common.json) {
    Json json{{"scene", command.arguments.scene.name},
              {"seed", command.arguments.scene.seed},
              {"points", points},
              {"width_m", scene.width_m()},
              {"height_m", scene.height_m()},
              {"seconds", tidy(seconds)}};
    json["files"] = Json::array();
    for (const WrittenFile& file : files)
      json["files"].push_back({{"path", file.path.string()}, {"points", file.points}});
    return print_json(json);
  }
  for (const WrittenFile& file : files)
    print_line(fmt::format("{}  {}", file.path.string(), counted(file.points, "point")));
  print_line(fmt::format("{} points on {:.0f} m x {:.0f} m in {}", grouped(points), scene.width_m(), scene.height_m(),
                         seconds_text(seconds)));
}

int run_synth(const SynthCommand& command) {
  if (command.drive.drive) {
    SceneArguments arguments = command.arguments;
    if (command.points_option->count() == 0) arguments.scene.points = kDrivePoints;
    return run_drive(arguments, command.drive, command.output, command.force, command.common);
  }
  const auto scene = command.arguments.create();
  const std::size_t files_wanted =
      command.files > 0
          ? command.files
          : std::min<std::size_t>(scene->blocks(), (command.arguments.scene.points + kFilePoints - 1) / kFilePoints);
  if (files_wanted > scene->blocks())
    throw Error(
        ErrorCode::kUsage,
        fmt::format("--files: a scene of this size has {} blocks, which gives at most as many files", scene->blocks()));
  const std::string crs = metric_crs(command.crs);
  std::vector<fs::path> paths;
  for (std::size_t k = 0; k < files_wanted; ++k)
    paths.push_back(fs::path(command.output) / (files_wanted == 1
                                                    ? command.arguments.scene.name + ".las"
                                                    : fmt::format("{}_{:03}.las", command.arguments.scene.name, k)));
  refuse_existing(paths, command.force);
  make_folders(command.output);

  watch_stop_signals();
  const auto threads = make_threads(command.common.thread_count());
  ProgressDisplay progress(command.common.progress_style());
  progress.begin("synth", command.arguments.scene.points, "points");
  const auto begun = std::chrono::steady_clock::now();
  std::vector<WrittenFile> files;
  for (std::size_t k = 0; k < files_wanted; ++k) {
    const auto writer = LasWriter::create(paths[k], crs, static_cast<LasPointFormat>(command.point_format));
    const std::size_t first = scene->blocks() * k / files_wanted, last = scene->blocks() * (k + 1) / files_wanted;
    const std::uint64_t points = write_blocks(*scene, first, last, command.point_format, *writer, *threads, progress);
    writer->commit();
    files.push_back({paths[k], points});
  }
  progress.finish();
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begun;
  print_synth(command, *scene, files, seconds.count());
  return 0;
}

constexpr const char* kSynthFooter =
    "Examples:\n"
    "  btms synth --scene city --points 2000000 -o demo\n"
    "  btms synth --scene hills --files 9 --origin 350000,5600000 --crs EPSG:25832 -o hills\n"
    "  btms synth --scene city --drive --scans 500 -o drive\n"
    "\n"
    "The class of every point is its truth (2 is ground), for `btms eval`. Any number of points is made in little "
    "memory. Equal options give equal bytes, on any\n"
    "machine and with any number of threads. The scene's area follows from --points and --density.\n"
    "\n"
    "With --drive a vehicle with a spinning scanner drives round a block or a hill in the middle of that area. Scans,\n"
    "labels, calib.txt and times.txt are laid out as SemanticKITTI's (velodyne/000000.bin, labels/000000.label).\n"
    "poses.txt takes scans to the map exactly, poses_drifting.txt as an odometry would that strays in roll, pitch and\n"
    "height; trajectory.txt is for `btms build --trajectory`. The terrain is that of the scene: `btms eval --map`\n"
    "takes the same options.";

}  // namespace

Command add_synth(CLI::App& btms) {
  auto command = std::make_shared<SynthCommand>();
  CLI::App* app =
      btms.add_subcommand("synth", "Make a synthetic world with exact truth, as LAS tiles or scans of a drive");
  app->footer(kSynthFooter);
  app->add_option("-o,--output", command->output, "Folder for the tiles or the drive; made when missing")
      ->required()
      ->type_name("DIR");
  add_scene_options(*app, command->arguments, "Options");
  command->points_option =
      app->add_option("--points", command->arguments.scene.points,
                      "Points, about; with --drive the area that so many would have (default of those: 2 million)")
          ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40))
          ->type_name("N");
  CLI::Option* files = app->add_option("--files", command->files,
                                       "Tiles to split the world into (default: at most 25 million points a tile)")
                           ->check(CLI::Range(std::size_t{1}, std::size_t{1000}))
                           ->default_str("")
                           ->type_name("K");
  CLI::Option* format =
      app->add_option("--point-format", command->point_format,
                      "LAS point format: 6, 30 bytes a point; or 0, 20 bytes, where cars and ceilings have class 1")
          ->check(CLI::IsMember({0, 6}))
          ->type_name("N");
  CLI::Option* crs = app->add_option("--crs", command->crs, "Reference system to name in the files, EPSG:n or WKT")
                         ->type_name("CRS")
                         ->default_str("");
  CLI::Option* drive = add_drive_options(*app, command->drive);
  for (CLI::Option* tiles : {files, format, crs}) drive->excludes(tiles);
  add_force_option(*app, command->force);
  add_run_options(*app, command->common);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_synth(*command); }};
}

}  // namespace btms
