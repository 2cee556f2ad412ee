// btms accumulate: scans, poses and labels in, one thinned partial map with truth out (paper III-B).
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>

#include "apps/btms/command.h"
#include "apps/btms/inputs.h"
#include "apps/btms/number_range.h"
#include "apps/btms/outputs.h"
#include "apps/btms/report.h"
#include "apps/btms/stop_signal.h"
#include "engine/accumulation/ground_alignment.h"
#include "engine/accumulation/voxel_map.h"
#include "engine/error.h"
#include "engine/metrics/metrics.h"
#include "engine/tiling/scan_segmenter.h"
#include "io/files/atomic_file.h"
#include "io/points/las_writer.h"
#include "io/points/pose_files.h"
#include "io/points/pose_text.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kTogether = 16;  // scans read at a time

struct AccumulateCommand {
  CommonOptions common;
  std::string scans, labels, poses, calibration, output, written_poses;
  double voxel_m = 0.2;
  double sensor_height_m = semantic_kitti_rules().sensor_height_m;
  std::uint64_t first = 0;
  std::optional<std::uint64_t> last;
  bool align_ground = false;
  bool force = false;
};

struct Scan {
  std::unique_ptr<PointFile> file;
  fs::path labels;  // empty: none
  Pose pose;
};

// A scan's file, the number it goes by, and the line of its pose.
struct NamedScan {
  fs::path path;
  std::size_t number = 0, line = 0;
};

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// The last number in a name, with what is before and behind it.
struct Name {
  std::string before, behind;
  std::optional<std::size_t> number;
};

Name name_of(const fs::path& scan) {
  constexpr std::ptrdiff_t kMostDigits = 18;
  const std::string stem = scan.stem().string();
  const auto end = std::find_if(stem.rbegin(), stem.rend(), is_digit).base();
  const auto begin = std::find_if_not(std::make_reverse_iterator(end), stem.rend(), is_digit).base();
  if (begin == end || end - begin > kMostDigits) return {stem, {}, {}};
  return {{stem.begin(), begin}, {end, stem.end()}, std::stoull(std::string(begin, end))};
}

// Scans named by a number alone belong to that line of the poses, as SemanticKITTI's do; others have one pose each, in
// the order of their numbers where nothing else tells their names apart (frame_2, frame_10), else in that of names.
std::vector<NamedScan> pair_with_poses(const std::vector<fs::path>& paths, std::size_t poses,
                                       const std::string& pose_file) {
  std::vector<Name> names;
  std::vector<NamedScan> scans;
  for (const fs::path& path : paths) {
    names.push_back(name_of(path));
    scans.push_back({path, names.back().number.value_or(0), 0});
  }
  const auto all = [&](const auto& holds) { return std::all_of(names.begin(), names.end(), holds); };
  const bool one_series = all([&](const Name& name) {
    return name.number && name.before == names[0].before && name.behind == names[0].behind;
  });
  const auto earlier = [](const NamedScan& a, const NamedScan& b) { return a.number < b.number; };
  if (one_series) {
    std::stable_sort(scans.begin(), scans.end(), earlier);
    for (std::size_t i = 1; i < scans.size(); ++i)
      if (scans[i].number == scans[i - 1].number)
        throw Error(ErrorCode::kUsage, "has the same number as " + scans[i - 1].path.filename().string(),
                    scans[i].path.string());
    if (names[0].before.empty() && names[0].behind.empty()) {
      for (NamedScan& scan : scans) scan.line = scan.number;
      return scans;
    }
  }
  if (poses != scans.size())
    throw Error(ErrorCode::kUsage,
                fmt::format("found {} poses for {} scans: name the scans by their line (000000.bin is the first), or "
                            "give one pose a scan",
                            poses, scans.size()),
                pose_file);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (!one_series && i > 0 && names[i].number && names[i - 1].number && *names[i].number < *names[i - 1].number)
      throw Error(ErrorCode::kUsage,
                  fmt::format("comes behind {} by its name, but before it by its number: name the scans by their line "
                              "(000000.bin is the first)",
                              scans[i - 1].path.filename().string()),
                  scans[i].path.string());
    scans[i].line = i;
    if (!one_series) scans[i].number = i;
  }
  return scans;
}

fs::path labels_of(const fs::path& scan, const std::string& folder) {
  if (folder.empty()) return {};
  for (const char* extension : {".label", ".labels"})
    if (const fs::path path = fs::path(folder) / (scan.stem().string() + extension); fs::exists(path)) return path;
  throw Error(ErrorCode::kUsage, "--labels: there is no " + scan.stem().string() + ".label in " + folder,
              scan.string());
}

void check_labels(const Scan& scan, std::uint64_t labels) {
  if (labels != scan.file->size())
    throw Error(ErrorCode::kBadInput,
                fmt::format("found {} labels, expected {} as in {}", labels, scan.file->size(), scan.file->name()),
                scan.labels.string());
}

std::vector<Scan> find_scans(const AccumulateCommand& command) {
  const std::string arguments[] = {command.scans};
  const InputList list = expand_inputs(arguments);
  std::vector<Pose> poses = read_poses(command.poses);
  if (!command.calibration.empty()) {
    const Pose to_camera = read_calibration(command.calibration), back = to_camera.inverse();
    for (Pose& pose : poses) pose = back.after(pose).after(to_camera);
  }
  log_warnings(list);
  std::vector<Scan> scans;
  for (const NamedScan& named : pair_with_poses(list.paths, poses.size(), command.poses)) {
    if (named.number < command.first || (command.last && named.number > *command.last)) continue;
    if (named.line >= poses.size())
      throw Error(ErrorCode::kUsage, fmt::format("there is no pose for it: {} has {}", command.poses, poses.size()),
                  named.path.string());
    const Scan& scan =
        scans.emplace_back(Scan{open_points(named.path), labels_of(named.path, command.labels), poses[named.line]});
    log_warnings(*scan.file);
    if (!scan.labels.empty())  // now and not after hours
      check_labels(scan, fs::file_size(scan.labels) / (scan.labels.extension() == ".label" ? 4 : 1));
  }
  if (scans.empty()) throw Error(ErrorCode::kUsage, "--first and --last leave no scan", command.scans);
  return scans;
}

// Empty without labels.
std::vector<std::uint32_t> classes_of(const Scan& scan) {
  if (scan.labels.empty()) return {};
  std::vector<std::uint32_t> classes = read_classes(scan.labels);
  check_labels(scan, classes.size());  // again: the file may have changed
  return classes;
}

// Classes of a partial map, as `btms eval --label-map partial-map` reads them.
enum MapClass : std::uint8_t { kIgnored = 0, kObject = 1, kTerrain = 2, kAmbiguousTerrain = 3, kAmbiguousObject = 5 };

MapClass map_class(std::uint32_t label, bool low, const TruthRules& rules) {
  const auto is = [&](const std::vector<std::uint32_t>& classes) {
    return std::find(classes.begin(), classes.end(), label) != classes.end();
  };
  if (is(rules.ignored)) return kIgnored;
  if (is(rules.ambiguous)) return low ? kAmbiguousTerrain : kAmbiguousObject;
  return is(rules.terrain) ? kTerrain : kObject;
}

// What voxels vote by: the label, and whether the point lies low enough under its sensor for an ambiguous class to be
// terrain.
constexpr std::uint32_t kLow = 1u << 31, kUnlabelled = kLow - 1;

// The points of a scan in the map frame.
struct ScanPart {
  std::vector<LabelledPoint> points;
  std::uint64_t not_finite = 0, out_of_range = 0;  // left out
};

ScanPart points_of(const Scan& scan, const TruthRules& rules) {
  const std::vector<std::uint32_t> classes = classes_of(scan);
  PointBlock block;
  scan.file->read(0, static_cast<std::size_t>(scan.file->size()), block);
  const auto vote = [&](std::uint32_t label, double z_m) {
    const bool ambiguous = std::find(rules.ambiguous.begin(), rules.ambiguous.end(), label) != rules.ambiguous.end();
    return ambiguous && z_m < -0.25 * rules.sensor_height_m ? label | kLow : label;
  };
  ScanPart part{{}, block.not_finite, block.out_of_range};
  part.points.reserve(block.size());
  for (std::size_t i = 0; i < block.size(); ++i) {
    if (block.x_mm[i] == PointBlock::kDroppedX) continue;
    const double z_m = block.z_mm[i] * 0.001;
    const auto place =
        scan.pose.to_map({static_cast<double>(block.x_mm[i]) * 0.001, static_cast<double>(block.y_mm[i]) * 0.001, z_m});
    const auto mm = [](double m) { return std::llround(m * 1000); };
    if (std::abs(place[2]) * 1000 > kMaxVertical_mm) {
      ++part.out_of_range;
      continue;
    }
    part.points.push_back({mm(place[0]), mm(place[1]), static_cast<std::int32_t>(mm(place[2])),
                           classes.empty() ? kUnlabelled : vote(classes[i], z_m)});
  }
  return part;
}

AlignedPoses align(std::vector<Scan>& scans, const Threads& threads, Progress& progress) {
  progress.begin("ground", scans.size(), "scans");
  std::vector<ScanSegmenter> segmenters;
  for (int i = 0; i < threads.count(); ++i) segmenters.emplace_back(preset("single-scan"));
  std::vector<std::vector<GroundPatch>> ground(scans.size());
  threads.for_each(scans.size(), [&](std::size_t i, int worker) {
    throw_if_stopped();
    PointBlock points;
    const PointFile& file = *scans[i].file;
    file.read(0, static_cast<std::size_t>(file.size()), points);
    if (points.dropped() < points.size())
      ground[i] = ground_patches(points, segmenters[static_cast<std::size_t>(worker)].segment(file));
    progress.advance(1);
  });
  std::vector<Pose> poses;
  for (const Scan& scan : scans) poses.push_back(scan.pose);
  AlignedPoses aligned = align_ground(ground, poses, progress);
  for (std::size_t i = 0; i < scans.size(); ++i) scans[i].pose = aligned.poses[i];
  return aligned;
}

struct MapCounts {
  std::uint64_t points = 0, not_finite = 0, out_of_range = 0;
  std::uint64_t voxels = 0, terrain = 0, object = 0, ambiguous = 0, ignored = 0;
};

void write_map(VoxelMap& map, const TruthRules& rules, LasWriter& writer, MapCounts& counts) {
  std::vector<LasPoint> records;
  const auto flush = [&] {
    writer.append(records);
    records.clear();
  };
  map.for_each_voxel([&](const LabelledPoint& p) {
    const MapClass c = map_class(p.label & ~kLow, (p.label & kLow) != 0, rules);
    ++counts.voxels;
    ++(c == kTerrain   ? counts.terrain
       : c == kObject  ? counts.object
       : c == kIgnored ? counts.ignored
                       : counts.ambiguous);
    records.push_back({p.x_mm, p.y_mm, p.z_mm, c, 0});
    if (records.size() == 65536) flush();
  });
  flush();
}

// Poses of a sensor whose z axis points up see the ground of one place at one height, give or take their drift.
void warn_of_camera_poses(const AccumulateCommand& command, const AlignedPoses& aligned) {
  constexpr double kStrange_m = 1, kStrangeCorrection_m = 20;
  if (command.calibration.empty() && (aligned.smear_before_m > kStrange_m || aligned.largest_m > kStrangeCorrection_m))
    spdlog::warn(
        "{}: ground of one place lay {:.1f} m apart, and poses were corrected by up to {:.1f} m; are these a "
        "camera's poses? Then give --calib",
        command.poses, aligned.smear_before_m, aligned.largest_m);
}

double tilt_deg(const AlignedPoses& aligned) { return std::atan(aligned.largest_slope) * 180 / std::numbers::pi; }

void print_accumulate(const AccumulateCommand& command, std::size_t scans, const MapCounts& counts,
                      const std::optional<AlignedPoses>& aligned, double seconds) {
  if (command.common.json) {
    Json json{{"output", command.output},
              {"scans", scans},
              {"points", counts.points},
              {"dropped", {{"not_finite", counts.not_finite}, {"out_of_range", counts.out_of_range}}},
              {"voxels", counts.voxels},
              {"terrain", counts.terrain},
              {"object", counts.object},
              {"ambiguous", counts.ambiguous},
              {"ignored", counts.ignored}};
    if (aligned)
      json["alignment"] = {{"smear_before_m", tidy(aligned->smear_before_m)},
                           {"smear_after_m", tidy(aligned->smear_after_m)},
                           {"largest_correction_m", tidy(aligned->largest_m)},
                           {"largest_tilt_deg", tidy(tilt_deg(*aligned))}};
    json["seconds"] = tidy(seconds);
    return print_json(json);
  }
  if (aligned)
    print_line(
        fmt::format("ground of one place, lowest to highest scan: {:.3f} m before, {:.3f} m aligned; poses were "
                    "corrected by up to {:.3f} m and {:.2f} deg",
                    aligned->smear_before_m, aligned->smear_after_m, aligned->largest_m, tilt_deg(*aligned)));
  if (counts.not_finite + counts.out_of_range > 0)
    print_line(fmt::format("left out: {} not finite, {} out of range", grouped(counts.not_finite),
                           grouped(counts.out_of_range)));
  if (!command.labels.empty())
    print_line(fmt::format("{} terrain, {} object, {} ambiguous, {} ignored", grouped(counts.terrain),
                           grouped(counts.object), grouped(counts.ambiguous), grouped(counts.ignored)));
  print_line(fmt::format("{}  {} of {} points in {}, {}", command.output, counted(counts.voxels, "voxel"),
                         grouped(counts.points), counted(scans, "scan"), seconds_text(seconds)));
}

int run_accumulate(const AccumulateCommand& command) {
  std::vector<fs::path> outputs{command.output};
  if (fs::path(command.output).extension() != ".las")
    throw Error(ErrorCode::kUsage, "--output: expected NAME.las", command.output);
  if (!command.written_poses.empty()) outputs.push_back(command.written_poses);
  refuse_existing(outputs, command.force);
  if (fs::weakly_canonical(command.output) == fs::weakly_canonical(command.written_poses))
    throw Error(ErrorCode::kUsage, "--write-poses: this is the --output, too", command.written_poses);
  std::vector<Scan> scans = find_scans(command);
  const auto writer = LasWriter::create(command.output);
  std::optional<AtomicFile> poses_file;
  if (!command.written_poses.empty()) poses_file.emplace(command.written_poses);

  watch_stop_signals();
  const auto threads = make_threads(command.common.thread_count());
  ProgressDisplay progress(command.common.progress_style());
  const auto begun = std::chrono::steady_clock::now();
  std::optional<AlignedPoses> aligned;
  if (command.align_ground) {
    aligned = align(scans, *threads, progress);
    warn_of_camera_poses(command, *aligned);
  }

  TruthRules rules = semantic_kitti_rules();
  rules.sensor_height_m = command.sensor_height_m;
  progress.begin("accumulate", scans.size(), "scans");
  VoxelMap map(static_cast<std::int32_t>(std::llround(command.voxel_m * 1000)));
  MapCounts counts;
  for (std::size_t begin = 0; begin < scans.size(); begin += kTogether) {
    std::vector<ScanPart> batch(std::min(kTogether, scans.size() - begin));
    threads->for_each(batch.size(), [&](std::size_t i, int) {
      throw_if_stopped();
      batch[i] = points_of(scans[begin + i], rules);
      progress.advance(1);
    });
    for (const ScanPart& part : batch) {
      map.add(part.points);
      counts.points += part.points.size();
      counts.not_finite += part.not_finite;
      counts.out_of_range += part.out_of_range;
    }
  }
  if (counts.points == 0) throw Error(ErrorCode::kBadInput, "the scans have no finite point", command.scans);
  write_map(map, rules, *writer, counts);
  if (poses_file) {
    std::vector<Pose> poses;
    for (const Scan& scan : scans) poses.push_back(scan.pose);
    const std::string text = kitti_poses(poses);
    poses_file->write(0, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
    poses_file->commit();
  }
  writer->commit();
  progress.finish();
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begun;
  print_accumulate(command, scans.size(), counts, aligned, seconds.count());
  return 0;
}

constexpr const char* kAccumulateFooter =
    "Examples:\n"
    "  btms synth --scene city --drive -o drive\n"
    "  btms accumulate --scans drive/velodyne --labels drive/labels --poses drive/poses_drifting.txt --align-ground "
    "\\\n"
    "      --write-poses aligned.txt -o partial.las\n"
    "  btms build partial.las -o partial.btms --preset partial-map --trajectory aligned.txt\n"
    "  btms accumulate --scans sequences/00/velodyne --labels sequences/00/labels --poses sequences/00/poses.txt \\\n"
    "      --calib sequences/00/calib.txt -o partial.las\n"
    "\n"
    "A voxel gives one point: the mean of what fell into it, with the label most of it has. Classes of the map, as\n"
    "`btms eval --label-map partial-map` reads them: 2 terrain, 1 object (also without --labels), 0 ignored, 3 and 5\n"
    "vegetation that counts as terrain or as object, which its height in the frame of its scan decides.\n"
    "Poses: KITTI (12 numbers a line) or TUM (8). Scans that are named by a number alone belong to that\n"
    "line (000000.bin to the first), others one by one, by the number in their names (frame_2 before frame_10). With\n"
    "--calib the poses are a camera's, and the map's frame is the first scan's.\n"
    "--align-ground corrects height, roll and pitch of the poses until scans that overlap see one ground.";

}  // namespace

Command add_accumulate(CLI::App& btms) {
  auto command = std::make_shared<AccumulateCommand>();
  CLI::App* app = btms.add_subcommand("accumulate", "Make one thinned map of many scans, with their poses and labels");
  app->footer(kAccumulateFooter);
  app->add_option("--scans", command->scans, "Folder or glob of scans")->required()->type_name("PATH");
  app->add_option("--poses", command->poses, "Poses, KITTI or TUM")->required()->type_name("FILE");
  app->add_option("-o,--output", command->output, "The map, NAME.las")->required()->type_name("FILE");
  app->add_option("--labels", command->labels, "Folder of labels, SemanticKITTI's")->type_name("DIR");
  app->add_option("--calib", command->calibration, "Calibration with a line `Tr:`, where poses are a camera's")
      ->type_name("FILE");
  app->add_option("--first", command->first, "First scan, by its number")->type_name("N");
  app->add_option("--last", command->last, "Last scan")->type_name("N");
  app->add_option("--voxel", command->voxel_m, "Edge of a voxel in metres")
      ->check(number_range(0.01, 10.0))
      ->type_name("D");
  app->add_option(
         "--sensor-height", command->sensor_height_m,
         "Of the sensor above ground, in metres: vegetation lower than a quarter of it under the sensor counts "
         "as terrain")
      ->check(number_range(0.0, 100.0))
      ->type_name("H");
  app->add_flag("--align-ground", command->align_ground, "Take the drift of height, roll and pitch out of the poses");
  app->add_option("--write-poses", command->written_poses, "Also write the poses used, KITTI format, map frame")
      ->type_name("FILE");
  add_force_option(*app, command->force);
  add_run_options(*app, command->common);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_accumulate(*command); }};
}

}  // namespace btms
