// btms eval: a segmentation against truth, with the paper's metrics.
#include "apps/btms/command.h"
#include "apps/btms/eval_files.h"
#include "apps/btms/eval_report.h"
#include "apps/btms/stop_signal.h"
#include "engine/error.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

struct EvalCommand {
  CommonOptions common;
  std::string truth, prediction, points;
  std::string label_map;
  std::vector<std::uint32_t> terrain, ignore, ambiguous;
  double sensor_height_m = 0;
  CLI::Option* terrain_option = nullptr;
  CLI::Option* ignore_option = nullptr;
  CLI::Option* ambiguous_option = nullptr;
  CLI::Option* sensor_height_option = nullptr;
  bool classes = false;
};

bool is_kitti(const fs::path& truth) {
  if (!fs::is_directory(truth)) return truth.extension() == ".label";
  for (const fs::directory_entry& entry : fs::directory_iterator(truth))
    if (entry.path().extension() == ".label") return true;
  return false;
}

TruthRules rules_for(const EvalCommand& command) {
  const bool kitti = command.label_map.empty() ? is_kitti(command.truth) : command.label_map == "kitti";
  TruthRules rules = kitti ? semantic_kitti_rules() : asprs_rules();
  if (command.terrain_option->count() > 0) rules.terrain = command.terrain;
  if (command.ignore_option->count() > 0) rules.ignored = command.ignore;
  if (command.ambiguous_option->count() > 0) rules.ambiguous = command.ambiguous;
  if (command.sensor_height_option->count() > 0) rules.sensor_height_m = command.sensor_height_m;
  return rules;
}

int run_eval(const EvalCommand& command) {
  for (const std::string& path : {command.truth, command.prediction})
    if (!fs::exists(path)) throw Error(ErrorCode::kUsage, "there is no such file or folder", path);
  const TruthRules rules = rules_for(command);
  const bool needs_z = rules.sensor_height_m > 0 && !rules.ambiguous.empty();
  const auto pairs = pair_files(command.truth, command.prediction, command.points, needs_z);

  watch_stop_signals();
  const auto threads = make_threads(command.common.thread_count());
  ProgressDisplay progress(command.common.progress_style());
  progress.begin("eval", pairs.size(), "files");
  std::vector<EvalResult> results(pairs.size());
  threads->for_each(pairs.size(), [&](std::size_t i, int) {
    throw_if_stopped();
    results[i] = evaluate(pairs[i], rules);
    progress.advance(1);
  });
  progress.finish();
  if (command.common.json)
    print_eval_json(results, rules);
  else
    print_eval_text(results, rules, command.classes);
  return 0;
}

constexpr const char* kFooter =
    "Examples:\n"
    "  btms eval --truth demo --prediction demo/labelled --classes\n"
    "  btms eval --truth sequences/00/labels --prediction predictions\n"
    "\n"
    "Folders are paired by the names of their files. Terrain is the positive class; type I is terrain called object,\n"
    "type II object called terrain. Predictions: .las (class 2 is terrain), .label (40 terrain, 0 left out) or "
    ".labels\n"
    "(1 terrain). Defaults of the truth's classes:\n"
    "  kitti  terrain 40 44 48 49 60 72, ignored 0 1, ambiguous 70: terrain below a quarter of the sensor's height of\n"
    "         1.73 m under the sensor; every table is given with and without it\n"
    "  asprs  terrain 2, ignored 7 9 17 18 20 26";

}  // namespace

Command add_eval(CLI::App& btms) {
  auto command = std::make_shared<EvalCommand>();
  CLI::App* app = btms.add_subcommand("eval", "Score labelled points against truth");
  app->footer(kFooter);
  app->add_option("--truth", command->truth, "Classified points: .las or .label, a file or a folder")
      ->required()
      ->type_name("PATH");
  app->add_option("--prediction", command->prediction, "What label or segment wrote: a file or a folder")
      ->required()
      ->type_name("PATH");
  app->add_option(
         "--points", command->points,
         "Scans with the heights of ambiguous points (default: the truth itself, or velodyne/ beside its folder)")
      ->default_str("")
      ->type_name("PATH");
  const char* group = "Truth (default: by label map)";
  app->add_option("--label-map", command->label_map, "kitti or asprs (default: kitti for .label, else asprs)")
      ->check(CLI::IsMember({"kitti", "asprs"}))
      ->default_str("")
      ->type_name("MAP")
      ->group(group);
  const auto class_list = [&](const char* name, std::vector<std::uint32_t>& list, const char* help) {
    return app->add_option(name, list, help)
        ->delimiter(',')
        ->allow_extra_args(false)
        ->default_str("")
        ->type_name("N,N...")
        ->group(group);
  };
  command->terrain_option = class_list("--terrain", command->terrain, "Classes that are terrain");
  command->ignore_option = class_list("--ignore", command->ignore, "Classes left out altogether");
  command->ambiguous_option =
      class_list("--ambiguous", command->ambiguous, "Classes that may be either, told by their height");
  command->sensor_height_option =
      app->add_option("--sensor-height", command->sensor_height_m,
                      "Of the sensor above ground, in metres; 0 leaves the ambiguous classes out")
          ->check(CLI::Range(0.0, 100.0))
          ->default_str("")
          ->type_name("H")
          ->group(group);
  app->add_flag("--classes", command->classes, "Also say for every true class how much of it was called terrain");
  add_run_options(*app, command->common);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_eval(*command); }};
}

}  // namespace btms
