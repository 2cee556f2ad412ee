// btms sweep: accuracy over parameters, with and without completion (the paper's Fig. 4).
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>

#include "apps/btms/command.h"
#include "apps/btms/inputs.h"
#include "apps/btms/outputs.h"
#include "apps/btms/parameter_options.h"
#include "apps/btms/stop_signal.h"
#include "apps/btms/sweep_plot.h"
#include "apps/btms/sweep_report.h"
#include "engine/error.h"
#include "engine/tiling/block_source.h"
#include "engine/tiling/scan_segmenter.h"
#include "io/files/atomic_file.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

struct SweepCommand {
  CommonOptions common;
  ParameterOptions parameters;
  std::vector<std::string> points, over;
  std::string truth, label_map, output;
  bool force = false;
};

// The paper's three: resolution, inclination and distance thresholds, or what stands for them coarse to fine (slopes
// are tangents there: 10 to 40 degrees).
std::vector<std::string> usual_axes(Method method) {
  const std::string resolution = "resolution=1,2,3,4,6,8";
  if (method == Method::kFixed)
    return {resolution, "slope_max_deg=10,15,20,25,30,35,40", "terrain_distance_m=0.05,0.1,0.125,0.2,0.3,0.4,0.5"};
  return {resolution, "slope_limit=0.176,0.268,0.364,0.466,0.577,0.7,0.839", "label_spread=1,2,3,4,6,8"};
}

struct Input {
  std::unique_ptr<PointFile> points;
  fs::path truth;
};

// A point file's classes: in the file itself, or by the same name in a folder.
fs::path truth_of(const fs::path& points, const fs::path& truth) {
  if (truth.empty()) return points;
  if (!fs::is_directory(truth)) return truth;
  for (const char* extension : {".label", ".labels", ".las"})
    if (fs::path path = truth / (points.stem().string() + extension); fs::exists(path)) return path;
  throw Error(ErrorCode::kUsage, "--truth: no .label, .labels or .las for " + points.filename().string(),
              truth.string());
}

std::vector<Input> find_inputs(const SweepCommand& command) {
  if (!command.truth.empty() && !fs::exists(command.truth))
    throw Error(ErrorCode::kUsage, "--truth: there is no such file or folder", command.truth);
  const InputList list = expand_inputs(command.points);
  if (list.paths.size() > 1 && !command.truth.empty() && !fs::is_directory(command.truth))
    throw Error(
        ErrorCode::kUsage,
        fmt::format("--truth: found one file for {} inputs, expected a folder with one for each", list.paths.size()),
        command.truth);
  log_warnings(list);
  std::vector<Input> inputs;
  for (const fs::path& path : list.paths) {
    inputs.push_back({open_points(path), truth_of(path, command.truth)});
    log_warnings(*inputs.back().points);
  }
  return inputs;
}

TruthRules rules_for(const SweepCommand& command, const Input& first) {
  if (!command.label_map.empty()) return rules_of_label_map(command.label_map);
  return rules_of_label_map(first.truth.extension() == ".label" ? "kitti" : "asprs");
}

const ParameterInfo& swept_parameter(std::string name) {
  std::replace(name.begin(), name.end(), '-', '_');
  for (const ParameterInfo& info : parameter_table())
    if (info.choices.empty() && (info.name == name || (info.name == "resolution_m" && name == "resolution")))
      return info;
  throw Error(ErrorCode::kUsage, "--over: '" + name + "' is no parameter with numbers; `btms params` lists them");
}

// Levels up to the coarsest of `base`, and no further.
int levels_from(double resolution_m, const Parameters& base) {
  const double coarsest_m = base.resolution_m * (1 << (base.levels - 1));
  int levels = 1;
  while (resolution_m * (1 << levels) <= coarsest_m) ++levels;
  return levels;
}

// One --over NAME=V,V...: a setting for each value, with and without completion.
void add_settings(const std::string& over, const Parameters& base, std::vector<SweepRow>& rows,
                  std::vector<Parameters>& settings) {
  const std::size_t equals = over.find('=');
  if (equals == std::string::npos || equals + 1 == over.size())
    throw Error(ErrorCode::kUsage, "--over: expected NAME=V,V... like resolution=1,2,4, found '" + over + "'");
  const ParameterInfo& info = swept_parameter(over.substr(0, equals));
  for (std::size_t at = equals + 1; at <= over.size();) {
    const std::size_t end = std::min(over.find(',', at), over.size());
    Parameters p = base;
    set_parameter(p, info.name, over.substr(at, end - at));
    if (info.name == "resolution_m" && p.method == Method::kCoarseToFine) p.levels = levels_from(p.resolution_m, base);
    double value = 0;
    const std::string text = parameter_text(p, info);
    std::from_chars(text.data(), text.data() + text.size(), value);
    for (const Completion completion : {Completion::kKernel, Completion::kNone}) {
      p.completion = completion;
      check(p);
      rows.push_back({std::string(info.name), value, completion, {}});
      settings.push_back(p);
    }
    at = end + 1;
  }
}

struct FileScores {
  Scores scores;
  std::uint64_t dropped = 0;
};

FileScores score_file(const Input& input, const Parameters& parameters, const TruthRules& rules) {
  const PointFile& points = *input.points;
  std::vector<std::uint32_t> truth = read_classes(input.truth);
  if (truth.size() != points.size())
    throw Error(ErrorCode::kBadInput,
                "found " + std::to_string(truth.size()) + " classes, expected " + std::to_string(points.size()) +
                    " as in " + points.name(),
                input.truth.string());
  PointBlock block;
  points.read(0, static_cast<std::size_t>(points.size()), block);
  ScanSegmenter segmenter(parameters);
  const std::span<const Label> labels = segmenter.segment(BlockSource(block, points.name()));
  std::vector<std::uint8_t> terrain;
  std::vector<float> z_m;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == Label::kDropped) continue;
    truth[kept++] = truth[i];
    terrain.push_back(labels[i] == Label::kTerrain);
    z_m.push_back(static_cast<float>(block.z_mm[i] * 0.001));
  }
  truth.resize(kept);
  return {score(truth, terrain, z_m, rules), labels.size() - kept};
}

int run_sweep(const SweepCommand& command) {
  const ParameterChoice choice = command.parameters.resolve();
  const std::vector<Input> inputs = find_inputs(command);
  const TruthRules rules = rules_for(command, inputs.front());
  Sweep sweep{choice.preset, inputs.size(), 0, false, {}};
  sweep.ambiguous = (rules.sensor_height_m > 0 && !rules.ambiguous.empty()) || !rules.decided_terrain.empty();
  std::vector<Parameters> settings;
  const auto axes = command.over.empty() ? usual_axes(choice.parameters.method) : command.over;
  for (const std::string& over : axes) add_settings(over, choice.parameters, sweep.rows, settings);
  for (SweepRow& row : sweep.rows) row.files.resize(inputs.size());
  const fs::path folder(command.output), csv = folder / "sweep.csv", svg = folder / "sweep.svg";
  refuse_existing(std::array{csv, svg}, command.force);
  make_folders(folder);

  watch_stop_signals();
  const auto threads = make_threads(command.common.thread_count());
  ProgressDisplay progress(command.common.progress_style());
  std::atomic<std::uint64_t> dropped = 0;
  const std::size_t runs = inputs.size() * settings.size();
  progress.begin("sweep", runs, "runs");
  threads->for_each(runs, [&](std::size_t i, int) {
    throw_if_stopped();
    const std::size_t file = i / settings.size(), row = i % settings.size();
    const FileScores scores = score_file(inputs[file], settings[row], rules);
    sweep.rows[row].files[file] = scores.scores;
    if (row == 0) dropped += scores.dropped;
    progress.advance(1);
  });
  progress.finish();
  sweep.dropped = dropped;
  const std::vector<Scores>& scored = sweep.rows[0].files;
  if (std::all_of(scored.begin(), scored.end(), [](const Scores& s) { return s.with.total() == 0; }))
    throw Error(ErrorCode::kBadInput, "no point has a class that counts: is it this --truth and --label-map?",
                command.truth.empty() ? command.points[0] : command.truth);

  write_sweep_csv(sweep, csv);
  write_sweep_plot(sweep, svg);
  if (command.common.json)
    print_sweep_json(sweep, folder);
  else
    print_sweep_text(sweep);
  return 0;
}

constexpr const char* kSweepFooter =
    "Every file is segmented alone, as by `btms segment`, once for every value of every --over and once more without\n"
    "completion; the other parameters stay as the preset, the file and the flags have them. DIR gets sweep.csv (a row "
    "a\n"
    "setting: mean and deviation over the files) and sweep.svg (a panel a parameter). The spread, greatest less least\n"
    "accuracy, says how much a wrong choice costs. Coarse to fine, another resolution takes levels off or adds some, "
    "so\n"
    "that the coarsest stays what it was.\n"
    "\n"
    "Examples:\n"
    "  btms sweep --points sequences/00/velodyne --truth sequences/00/labels --preset single-scan -o sweep\n"
    "  btms sweep --points map.las --label-map partial-map -o sweep\n"
    "  btms sweep --points map.las --over resolution=1,2,4,8 --over keep-nodes=1,5,10,20 \\\n"
    "      --preset paper-partial-map -o sweep";

}  // namespace

Command add_sweep(CLI::App& btms) {
  auto command = std::make_shared<SweepCommand>();
  CLI::App* app = btms.add_subcommand("sweep", "Accuracy over parameters, with and without completion: table and plot");
  app->footer(kSweepFooter);
  app->add_option("--points", command->points, "Scans or classified maps: files, folders of them, or globs")
      ->required()
      ->default_str("")
      ->type_name("PATH...");
  app->add_option("--truth", command->truth, "Their classes, a file or a folder (default: the points themselves)")
      ->default_str("")
      ->type_name("PATH");
  app->add_option("--label-map", command->label_map,
                  "kitti, rellis, asprs or partial-map (default: kitti for .label, else asprs)")
      ->check(CLI::IsMember(label_map_names()))
      ->default_str("")
      ->type_name("MAP");
  app->add_option("--over", command->over,
                  "A parameter and its values; may be given several times (default: resolution, slope and distance)")
      ->allow_extra_args(false)
      ->default_str("")
      ->type_name("NAME=V,V...");
  app->add_option("-o,--output", command->output, "Folder for table and plot; made when missing")
      ->required()
      ->type_name("DIR");
  add_force_option(*app, command->force);
  add_run_options(*app, command->common);
  command->parameters.add_to(*app, "partial-map");
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_sweep(*command); }};
}

}  // namespace btms
