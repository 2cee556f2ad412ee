// btms eval: a segmentation against truth, with the paper's metrics; a map against the exact terrain of a scene.
#include <array>
#include <charconv>
#include <cmath>

#include "apps/btms/command.h"
#include "apps/btms/eval_files.h"
#include "apps/btms/eval_map.h"
#include "apps/btms/eval_picture.h"
#include "apps/btms/eval_report.h"
#include "apps/btms/number_range.h"
#include "apps/btms/open_map.h"
#include "apps/btms/outputs.h"
#include "apps/btms/scene_options.h"
#include "apps/btms/stop_signal.h"
#include "engine/error.h"
#include "engine/query/tile_cache.h"

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
  std::string picture;
  std::vector<double> picture_box_m;  // x0, y0, x1, y1, or none
  std::string map;
  SceneArguments arguments;
  double spacing_m = 0.5;
  CLI::Option* scene_option = nullptr;
};

bool is_kitti(const fs::path& truth) {
  if (!fs::is_directory(truth)) return truth.extension() == ".label";
  for (const fs::directory_entry& entry : fs::directory_iterator(truth))
    if (entry.path().extension() == ".label") return true;
  return false;
}

TruthRules label_map_rules(const EvalCommand& command) {
  if (command.label_map.empty()) return is_kitti(command.truth) ? semantic_kitti_rules() : asprs_rules();
  return rules_of_label_map(command.label_map);
}

TruthRules rules_for(const EvalCommand& command) {
  TruthRules rules = label_map_rules(command);
  if (command.terrain_option->count() > 0) rules.terrain = command.terrain;
  if (command.ignore_option->count() > 0) rules.ignored = command.ignore;
  if (command.ambiguous_option->count() > 0) rules.ambiguous = command.ambiguous;
  if (command.sensor_height_option->count() > 0) rules.sensor_height_m = command.sensor_height_m;
  return rules;
}

// Of --points, which is a number with --map.
std::uint64_t parse_count(const std::string& text) {
  std::uint64_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (error != std::errc() || end != text.data() + text.size())
    throw Error(ErrorCode::kUsage, "--points: with --map this is the number given to `synth`, not '" + text + "'");
  return count;
}

int run_map_eval(const EvalCommand& command) {
  if (command.scene_option->count() == 0)
    throw Error(ErrorCode::kUsage, "--map needs --scene NAME, with the other options of the `synth` call that made it");
  SceneArguments arguments = command.arguments;
  if (!command.points.empty()) arguments.scene.points = parse_count(command.points);
  const auto scene = arguments.create();
  const TileCache map(open_map(command.map));
  watch_stop_signals();
  const auto threads = make_threads(command.common.thread_count());
  ProgressDisplay progress(command.common.progress_style());
  const auto samples = sample_map(map, *scene, command.spacing_m, *threads, progress);
  progress.finish();
  const MapEvalHeading heading{command.map, arguments.scene, command.spacing_m};
  warn_of_another_scene(samples);
  if (command.common.json)
    print_map_eval_json(heading, samples);
  else
    print_map_eval_text(heading, samples);
  return 0;
}

std::optional<PlanBox> picture_box(const EvalCommand& command) {
  if (command.picture_box_m.empty()) return {};
  std::array<std::int64_t, 4> mm{};
  bool good = command.picture_box_m.size() == mm.size();
  for (std::size_t i = 0; good && i < mm.size(); ++i) {
    good = std::abs(command.picture_box_m[i]) <= static_cast<double>(kMaxHorizontal_mm) / 1000;
    if (good) mm[i] = std::llround(command.picture_box_m[i] * 1000);
  }
  const PlanBox box{mm[0], mm[1], mm[2], mm[3]};
  if (!good || box.empty())
    throw Error(ErrorCode::kUsage, "--picture-box: expected X0,Y0,X1,Y1 in metres with X0 < X1 and Y0 < Y1");
  return box;
}

void check_eval_picture(const EvalCommand& command, const std::vector<EvalPair>& pairs) {
  std::vector<fs::path> inputs;
  for (const EvalPair& pair : pairs) inputs.insert(inputs.end(), {pair.truth, pair.prediction, pair.points});
  check_picture(command.picture, {}, inputs);
}

int run_eval(const EvalCommand& command) {
  if (!command.map.empty()) return run_map_eval(command);
  if (command.truth.empty() || command.prediction.empty())
    throw Error(ErrorCode::kUsage, "give --truth and --prediction, or --map and --scene");
  for (const std::string& path : {command.truth, command.prediction})
    if (!fs::exists(path)) throw Error(ErrorCode::kUsage, "there is no such file or folder", path);
  const TruthRules rules = rules_for(command);
  const bool needs_z = rules.sensor_height_m > 0 && !rules.ambiguous.empty(), draws = !command.picture.empty();
  const auto box = picture_box(command);
  const auto pairs = pair_files(command.truth, command.prediction, command.points, needs_z || draws);
  if (draws) check_eval_picture(command, pairs);

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
  if (draws) write_eval_picture(pairs, rules, box, command.picture);
  if (command.common.json)
    print_eval_json(results, rules);
  else
    print_eval_text(results, rules, command.classes);
  return 0;
}

constexpr const char* kEvalFooter =
    "Examples:\n"
    "  btms eval --truth demo --prediction demo/labelled --classes\n"
    "  btms eval --truth demo --prediction demo/labelled --picture wrong.png --picture-box 0,0,100,80\n"
    "  btms eval --truth sequences/00/labels --prediction predictions\n"
    "  btms eval --label-map partial-map --truth map.las --prediction labelled --picture wrong.png\n"
    "  btms eval --map demo/city.btms --scene city --points 2000000\n"
    "\n"
    "Folders are paired by the names of their files. Terrain is the positive class; type I is terrain called object,\n"
    "type II object called terrain. Predictions: .las (class 2 is terrain), .label (40 terrain, 0 left out) or "
    ".labels\n"
    "(1 terrain). Defaults of the truth's classes:\n"
    "  kitti  terrain 40 44 48 49 60 72, ignored 0 1, ambiguous 70: terrain below a quarter of the sensor's height of\n"
    "         1.73 m under the sensor; every table is given with and without it\n"
    "  rellis  terrain 1 3 10 15 23 31 33 34, ignored 0, ambiguous 19, sensor 1.2 m above ground\n"
    "  asprs  terrain 2, ignored 7 9 17 18 20 26\n"
    "  partial-map  of `btms accumulate`: terrain 2, object 1, ignored 0 7; 3 and 5 are ambiguous points decided scan\n"
    "         by scan, terrain (3) or object (5) in the table with them, left out of the one without\n"
    "\n"
    "The picture shows all files from above: the paper's colours, right terrain green, right objects\n"
    "black, terrain called object blue, object called terrain "
    "red.\n"
    "Wrong points lie above the others and are at least 3 pixels wide, so it makes them look like more than they are.\n"
    "\n"
    "With --map the heights of the map are compared with the exact terrain of a scene, everywhere, also below what\n"
    "stands on it. Give the scene's options as to `btms synth`. Error is surface minus truth, in metres; places where "
    "the\n"
    "terrain itself jumps by half a metre are counted apart (`at steps`). `complete` is the share of places with a\n"
    "surface, `filled` the share where it is a mere guess, `95 %` how often the truth lies within 1.96 sd.";

}  // namespace

Command add_eval(CLI::App& btms) {
  auto command = std::make_shared<EvalCommand>();
  CLI::App* app = btms.add_subcommand("eval", "Score labelled points, or a map, against truth");
  app->footer(kEvalFooter);
  app->add_option("--truth", command->truth, "Classified points: .las or .label, a file or a folder")
      ->default_str("")
      ->type_name("PATH");
  app->add_option("--prediction", command->prediction, "What label or segment wrote: a file or a folder")
      ->default_str("")
      ->type_name("PATH");
  app->add_option(
         "--points", command->points,
         "Scans with the heights of ambiguous points (default: the truth itself, or velodyne/ beside its folder); with "
         "--map the number given to synth")
      ->default_str("")
      ->type_name("PATH|N");
  const char* group = "Truth (default: by label map)";
  app->add_option("--label-map", command->label_map,
                  "kitti, rellis, asprs or partial-map (default: kitti for .label, else asprs)")
      ->check(CLI::IsMember(label_map_names()))
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
          ->check(number_range(0.0, 100.0))
          ->default_str("")
          ->type_name("H")
          ->group(group);
  app->add_flag("--classes", command->classes, "Also say for every true class how much of it was called terrain");
  CLI::Option* picture = app->add_option("--picture", command->picture, "Also draw the points and what is wrong")
                             ->default_str("")
                             ->type_name("FILE.png");
  app->add_option("--picture-box", command->picture_box_m, "Draw only what lies in it, in metres")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->needs(picture)
      ->default_str("")
      ->type_name("X0,Y0,X1,Y1");
  const char* map_group = "A map against a scene";
  CLI::Option* map = app->add_option("--map", command->map, "A map made by `btms build`")
                         ->default_str("")
                         ->excludes("--truth")
                         ->excludes("--prediction")
                         ->excludes(picture)
                         ->type_name("MAP")
                         ->group(map_group);
  command->scene_option = add_scene_options(*app, command->arguments, map_group)->needs(map);
  app->add_option("--spacing", command->spacing_m, "Between the places compared, in metres")
      ->check(number_range(0.01, 1000.0))
      ->type_name("D")
      ->group(map_group);
  for (const char* name : {"--density", "--seed", "--origin", "--spacing"}) app->get_option(name)->needs(map);
  for (const char* name : {"--label-map", "--terrain", "--ignore", "--ambiguous", "--sensor-height", "--classes"})
    map->excludes(name);
  add_run_options(*app, command->common);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_eval(*command); }};
}

}  // namespace btms
