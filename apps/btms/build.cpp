// btms build: point files in, a map on disk out.
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <charconv>
#include <chrono>

#include "apps/btms/build_report.h"
#include "apps/btms/command.h"
#include "apps/btms/continuation.h"
#include "apps/btms/dry_run.h"
#include "apps/btms/inputs.h"
#include "apps/btms/memory_option.h"
#include "apps/btms/open_map.h"
#include "apps/btms/outputs.h"
#include "apps/btms/parameter_options.h"
#include "apps/btms/process_group.h"
#include "apps/btms/reference_system.h"
#include "apps/btms/stop_signal.h"
#include "engine/error.h"
#include "engine/model/surface.h"
#include "engine/query/tile_cache.h"
#include "io/export/relief.h"
#include "io/files/content_print.h"
#include "io/points/trajectory.h"
#include "io/store/journal.h"
#include "io/store/map_store.h"
#include "io/store/part_ranks.h"
#include "io/store/round_files.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

struct BuildCommand {
  CommonOptions common;
  MemoryOption memory;
  ParameterOptions parameters;
  PointFileOptions points;
  std::vector<std::string> inputs;
  std::string output, crs, to_crs, trajectory, picture, layer = "state";
  std::string tile_cells = "auto", executor = "tbb", neighbours = "nanoflann";
  std::uint64_t max_nodes = BuildOptions{}.max_nodes;
  bool dry_run = false;
  ContinuationRequest continuation;
  double checkpoint_every_s = RoundFilesOptions{}.checkpoint_every_s;
  std::string part;  // I/N
  double wait_s = 1;
};

struct Executor {
  bool parallel = true;
  int ranks = 1;
};

// Reads a whole number in [min, max], or nothing.
std::optional<int> whole_number(std::string_view text, int min, int max) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < min || value > max) return {};
  return value;
}

Executor parse_executor(const std::string& text) {
  if (text == "serial") return {false, 1};
  if (text == "tbb") return {true, 1};
  if (text.starts_with("ranks:"))
    if (const auto n = whole_number(std::string_view(text).substr(6), 1, 64)) return {true, *n};
  throw Error(ErrorCode::kUsage,
              fmt::format("--executor: found `{}`, expected serial, tbb or ranks:N with N from 1 to 64", text));
}

std::optional<std::int32_t> parse_tile_cells(const std::string& text) {
  if (text == "auto") return std::nullopt;
  if (text == "whole") return 0;
  if (const auto n = whole_number(text, 1, 1 << 15)) return *n;
  throw Error(ErrorCode::kUsage,
              fmt::format("--tile-cells: found `{}`, expected a number from 1 to 32768, whole or auto", text));
}

// One of the processes of a job array that build a map together; of 1 where there is no array.
struct Part {
  int part = 0, parts = 1;
};

Part parse_part(const std::string& text) {
  const std::size_t slash = text.find('/');
  if (slash != std::string::npos)
    if (const auto n = whole_number(std::string_view(text).substr(slash + 1), 1, kMostParts))
      if (const auto i = whole_number(std::string_view(text).substr(0, slash), 1, *n)) return {*i - 1, *n};
  throw Error(ErrorCode::kUsage,
              fmt::format("--part: found `{}`, expected I/N with I from 1 to N, N from 1 to {}", text, kMostParts));
}

// What every rank runs: builds its share, writes its shards; rank 0 publishes.
// Returns the summary, the same on every rank.
BuildSummary build_rank(const BuildCommand& command, const PointFiles& files, BuildOptions options, MapInfo info,
                        const Continuation& going_on, const Executor& executor, Ranks& ranks, bool& at_work) {
  std::vector<const PointSource*> sources;
  for (const auto& file : files) sources.push_back(file.get());
  const auto threads = executor.parallel
                           ? make_threads(std::max(1, command.common.thread_count() / processes_here(ranks.size())))
                           : serial_threads();
  ProgressDisplay progress(ranks.rank() == 0 ? command.common.progress_style() : ProgressStyle::kNone,
                           build_plan(options.parameters));

  RoundFiles rounds(command.output, {.revision = going_on.revision,
                                     .rank = ranks.rank(),
                                     .ranks = ranks.size(),
                                     .follow = going_on.follow,
                                     .resume = going_on.resume,
                                     .keep_all = going_on.since > 0,
                                     .since = going_on.since,
                                     .files = going_on.round_files,
                                     // A part may have to get back to where it was many times.
                                     .checkpoint_every_s = ranks.in_step() ? command.checkpoint_every_s : 0});
  std::unique_ptr<MapReader> before;
  if (going_on.follow) before = MapReader::open(command.output);
  options.memory = &rounds;
  options.before = before.get();
  std::unique_ptr<MapWriter> writer;
  const auto make_sink = [&](const MapLayout& layout) -> TileSink& {
    writer = MapWriter::create(command.output, layout,
                               {.rank = ranks.rank(),
                                .crs = info.crs_wkt,
                                .identity = build_identity(info),
                                .resume = going_on.resume,
                                .leave = !ranks.in_step()});
    at_work = ranks.rank() == 0;
    if (writer->revision() != going_on.revision)
      throw Error(ErrorCode::kFailed, "another build has replaced the map meanwhile; start again", command.output);
    return *writer;
  };
  BuildSummary summary = build_map(sources, options, *threads, ranks, make_sink, progress);

  std::vector<Bytes> to_ranks(static_cast<std::size_t>(ranks.size()));
  to_ranks[0] = writer->finish();
  const std::vector<Bytes> entries = ranks.exchange(std::move(to_ranks));
  if (ranks.rank() == 0) {
    throw_if_stopped();  // the last chance: from here on the map is there
    info.layout = summary.layout;
    info.updatable_since = going_on.since;
    info.digest = summary.digest;
    info.points = summary.points;
    info.dropped = summary.not_finite + summary.out_of_range + summary.strays;
    writer->publish(info, entries);
    at_work = false;
  }
  // No rank ends before the map is there.
  if (ranks.in_step()) ranks.exchange(std::vector<Bytes>(static_cast<std::size_t>(ranks.size())));
  return summary;
}

// Whether any pose has terrain below it that can have borne the sensor.
bool bore_the_sensor(const TileSource& map, const std::vector<TrajectoryPoint>& trajectory) {
  return std::any_of(trajectory.begin(), trajectory.end(), [&](const TrajectoryPoint& p) {
    const SurfacePoint s = surface_at(map, static_cast<double>(p.x_mm) / 1000, static_cast<double>(p.y_mm) / 1000);
    return s.state != NodeState::kUnknown && Passage{{}, 0, 0, p.z_mm}.borne_by(s.z_m * 1000);
  });
}

// An update keeps to the parameters of the map.
void follow_parameters(const MapInfo& map, const ParameterOptions& options, ParameterChoice& choice) {
  if (options.given() && !(choice.parameters == map.parameters))
    throw Error(ErrorCode::kUsage,
                "an update keeps the parameters that the map was built with; leave the options out, or build it anew");
  choice = {map.parameters, map.preset};
}

int run_build(const BuildCommand& command) {
  ParameterChoice choice = command.parameters.resolve();
  const Executor executor = parse_executor(command.executor);
  const Part part = command.part.empty() ? Part{} : parse_part(command.part);
  if (part.parts > 1 && executor.ranks > 1)
    throw Error(ErrorCode::kUsage, "--part: ranks of a part; leave out --executor ranks:N, or choose more parts");
  BuildOptions options;
  options.parameters = choice.parameters;
  options.tile_cells = parse_tile_cells(command.tile_cells);
  options.neighbours_by_lattice = command.neighbours == "lattice";
  options.max_nodes = command.max_nodes;
  options.memory_bytes = command.memory.limit();
  if (options.memory_bytes != kUnlimited_bytes) options.memory_bytes /= static_cast<unsigned>(executor.ranks);
  options.spill_folder = command.memory.spill_folder(command.output);
  if (fs::exists(command.output) && !fs::is_directory(command.output))
    throw Error(ErrorCode::kUsage, "the map would replace this file; choose another name", command.output);
  if (command.inputs.empty() && !command.continuation.update)
    throw Error(ErrorCode::kUsage, "no INPUT: name point files, folders or globs");
  InputList list = expand_inputs(command.inputs);
  MapInfo info;
  CrsChoice crs{command.crs, command.to_crs};
  if (command.continuation.update) {
    const MapInfo map = open_map(command.output)->info();
    list = updated_inputs(map, command.output, command.continuation, list);
    follow_parameters(map, command.parameters, choice);
    const std::string trajectory = command.trajectory.empty() ? "" : content_print(command.trajectory).text;
    if (trajectory != (map.trajectory ? map.trajectory->content : ""))
      throw Error(ErrorCode::kUsage,
                  "an update needs the very --trajectory that the map was built with; with another one build it anew",
                  command.output);
    if (command.tile_cells != "auto")
      throw Error(ErrorCode::kUsage, "an update keeps the tiles of the map; leave out --tile-cells, or build it anew");
    if (crs.taken_to_be.empty() && crs.converted_to.empty())
      (map.crs_given ? crs.taken_to_be : crs.converted_to) = map.crs_wkt;
    info.follows = map.revision;
    options.parameters = choice.parameters;
    options.tile_cells =
        map.layout.grid.origin == Cell{} ? map.layout.grid.edge_cells >> (level_count(choice.parameters) - 1) : 0;
  }
  const auto& paths = list.paths;
  if (!command.picture.empty()) {
    std::vector<fs::path> read = paths;
    if (!command.trajectory.empty()) read.emplace_back(command.trajectory);
    check_picture(command.picture, command.output, read);
  }
  const PictureLayer& layer = picture_layer(command.layer);
  if (!command.trajectory.empty()) {
    options.trajectory = read_trajectory(command.trajectory);
    info.trajectory = {fs::path(command.trajectory).filename().string(), options.trajectory.size(),
                       fs::file_size(command.trajectory), content_print(command.trajectory).text};
  }
  info.parameters = choice.parameters;
  info.preset = choice.preset;
  BuildReport report;
  // Opened once: a file that changes from here on is noticed when it is read.
  PointFiles files = open_all(paths, command.points);
  log_warnings(list, files);
  report.warnings = list.warnings;
  const std::size_t logged = report.warnings.size();
  info.crs_wkt = agree_on_crs(files, crs, report.warnings);
  info.crs_given = !crs.taken_to_be.empty();
  for (std::size_t i = logged; i < report.warnings.size(); ++i) spdlog::warn("{}", report.warnings[i]);
  for (const auto& file : files) {
    info.inputs.push_back(input_record(*file, command.output));
    report.inputs.push_back(input_json(*file));
  }
  spdlog::debug("{} inputs, preset {}, executor {}", paths.size(), choice.preset, command.executor);
  if (command.dry_run) {
    const int threads = executor.parallel ? std::max(command.common.thread_count(), executor.ranks) : 1;
    print_dry_run(dry_run(files, options, threads), command.common.json);
    return 0;
  }

  info.layout.grid.edge_cells = tile_cells(options) << (level_count(options.parameters) - 1);
  info.updatable_since = options.parameters.method == Method::kCoarseToFine &&
                         (command.continuation.updatable || command.continuation.update);
  ContinuationRequest request = command.continuation;
  request.resume |= !command.part.empty();
  const Continuation going_on = continuation(command.output, info, request);
  if (going_on.finished) {
    spdlog::info("the map is finished already, nothing to do");
    if (command.common.json) print_json(Json{{"map", command.output}, {"finished_before", true}});
    return 0;
  }
  watch_stop_signals();
  const auto begun = std::chrono::steady_clock::now();
  bool at_work = false;  // rank 0 has a writer that has not published yet
  const auto body = [&](Ranks& ranks) {
    BuildSummary summary = build_rank(command, files, options, info, going_on, executor, ranks, at_work);
    if (ranks.rank() == 0) report.summary = std::move(summary);
  };
  try {
    if (part.parts > 1)
      body(*part_ranks(parts_folder(command.output), {.part = part.part,
                                                      .parts = part.parts,
                                                      .identity = stored_identity(info),
                                                      .wait_s = command.wait_s,
                                                      .stop_requested = stop_signalled}));
    else
      run_on_ranks(executor.ranks, body);
  } catch (const Error&) {
    if (part.parts == 1 && at_work && read_journals(command.output))
      spdlog::warn("what is done stays in {}: the same command with --resume goes on from there", command.output);
    throw;
  }
  if (part.part > 0) {
    spdlog::info("part {} of {} is done", part.part + 1, part.parts);
    if (command.common.json) print_json(Json{{"map", command.output}, {"part", part.part + 1}, {"parts", part.parts}});
  }
  if (!is_first_process() || part.part > 0) return 0;
  report.updated = going_on.follow;
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();

  const auto warn = [&](std::string warning) {
    spdlog::warn("{}", warning);
    report.warnings.push_back(std::move(warning));
  };
  if (report.summary.strays > 0)
    warn(
        fmt::format("{} more than 10 km from all others: left out as astray", counted(report.summary.strays, "point")));
  if (report.summary.outside_box > 0)
    warn(fmt::format("{} outside the bounding box of the file's header: kept",
                     counted(report.summary.outside_box, "point")));
  if (report.summary.observed + report.summary.predicted == 0)
    warn(
        "no terrain was found: try a smaller --resolution or --min-points, or --preset partial-map for a map made by "
        "a robot");
  if (info.trajectory && !bore_the_sensor(TileCache(MapReader::open(command.output)), options.trajectory))
    warn(
        "the trajectory changes nothing: no pose lies close above the map's terrain; is it in the frame of the points, "
        "in metres?");
  report.trajectory = info.trajectory;
  if (!command.picture.empty()) write_relief(*MapReader::open(command.output), command.picture, kReliefPixels, layer);
  report.map = command.output;
  report.picture = command.picture;
  report.choice = choice;
  report.executor = command.executor;
  print_build_report(report, command.common.json);
  return 0;
}

constexpr const char* kBuildFooter =
    "Examples:\n"
    "  btms build tiles/ -o city.btms\n"
    "  btms build 'survey/*.las' -o hills.btms --resolution 2 --slope-max-deg 30 --picture hills.png\n"
    "  btms build tiles/ -o city.btms --picture cost.png --layer cost --vehicle-max-step-m 0.1\n"
    "  btms build scan.bin -o scan.btms --preset single-scan --tile-cells whole\n"
    "  btms build tiles/ -o city.btms --dry-run\n"
    "  btms build tiles/ -o city.btms --resume                # after Ctrl-C, a crash, a full disk\n"
    "  btms build tiles/ -o city.btms --updatable\n"
    "  btms build survey2.las -o city.btms --update           # and --remove old.las, --replace\n"
    "  btms build tiles/ -o city.btms --part 3/8 --wait 3600  # task 3 of a job array of 8\n"
    "\n"
    "The map has the same digest for any order or splitting of the inputs, tile size, executor and thread count.\n"
    "An older map in the same place is replaced only once the new one is complete.\n"
    "A few points more than 10 km from all others are left out and counted as astray.";

}  // namespace

Command add_build(CLI::App& btms) {
  auto command = std::make_shared<BuildCommand>();
  CLI::App* app = btms.add_subcommand("build", "Build a map: point files in, a terrain model on disk out");
  app->footer(kBuildFooter);
  app->add_option("INPUT", command->inputs, "Point files, folders of them, or globs")->default_str("")->type_name("");
  app->add_option("-o,--output", command->output, "The map's folder, by custom called NAME.btms")
      ->required()
      ->type_name("MAP");
  app->add_option(
         "--crs", command->crs,
         "Reference system of the coordinates, EPSG:n or WKT, whatever the inputs say (default: what they say)")
      ->type_name("CRS")
      ->default_str("");
  app->add_option("--to-crs", command->to_crs,
                  "Reference system of the map: inputs that name another one are converted (default: that of the first "
                  "input that names one)")
      ->type_name("CRS")
      ->default_str("")
      ->excludes("--crs");
  add_columns_option(*app, command->points);
  app->add_option("--trajectory", command->trajectory,
                  "Where the sensor has been, as text in the frame of the points (x y z, TUM or KITTI): what it passed "
                  "over is terrain")
      ->type_name("FILE")
      ->default_str("");
  app->add_option("--picture", command->picture, "Also write a shaded relief of the map")
      ->type_name("FILE.png")
      ->default_str("");
  app->add_option("--layer", command->layer,
                  "What colours the picture: state, cost, slope, step, roughness or clearance")
      ->type_name("NAME")
      ->needs("--picture");
  app->add_flag("--dry-run", command->dry_run,
                "Write nothing: say what the build will take in time, memory and disk, from a sample of the points");
  const char* going_on = "Going on from what is there";
  app->add_flag("--resume", command->continuation.resume,
                "Take up a build that was interrupted: what it has committed is not written again")
      ->group(going_on);
  app->add_flag("--updatable", command->continuation.updatable,
                "Keep what updates need beside the map (about as much disk again)")
      ->group(going_on);
  app->add_flag("--update", command->continuation.update,
                "INPUTs are added to the map's own; only what they change is worked out. The result is that of a build "
                "of all of them")
      ->group(going_on);
  app->add_flag("--replace", command->continuation.replace, "INPUTs take the place of inputs of the same name")
      ->needs("--update")
      ->group(going_on);
  app->add_option("--remove", command->continuation.removed, "Take this input out of the map; may be repeated")
      ->needs("--update")
      ->type_name("NAME")
      ->default_str("")
      ->group(going_on);
  const char* array = "Job arrays (without MPI)";
  CLI::Option* part = app->add_option("--part", command->part,
                                      "Build part I of N of the map; run all parts, at once or again and again, until "
                                      "`btms join MAP` says that it is done")
                          ->type_name("I/N")
                          ->default_str("")
                          ->excludes("--update")
                          ->excludes("--updatable")
                          ->group(array);
  app->add_option("--wait", command->wait_s,
                  "How long a part waits for what it needs of the others, before it ends to be run again")
      ->check(CLI::Range(0.0, 1e9))
      ->type_name("SECONDS")
      ->needs(part)
      ->group(array);
  app->add_option("--checkpoint-every", command->checkpoint_every_s,
                  "Save what --resume goes on from after this many seconds, when a level is done")
      ->check(CLI::Range(0.0, 1e9))
      ->type_name("SECONDS")
      ->group(going_on);
  app->add_option("--tile-cells", command->tile_cells,
                  "Edge of a tile in cells of the coarsest level, whole for one tile; auto is 128 of the finest level")
      ->type_name("N");
  app->add_option("--executor", command->executor, "serial, tbb (threads), or ranks:N (processes that share nothing)")
      ->type_name("KIND")
      ->group("Running");
  app->add_option("--neighbours", command->neighbours, "Neighbour search: nanoflann or lattice; the result is the same")
      ->check(CLI::IsMember({"nanoflann", "lattice"}))
      ->type_name("KIND")
      ->group("Running");
  app->add_option("--max-nodes", command->max_nodes,
                  "Refuse larger maps (a stray point far out) before allocating them")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40))
      ->type_name("N")
      ->group("Running");
  command->memory.add_to(*app, true);
  add_run_options(*app, command->common);
  command->parameters.add_to(*app, "city");
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_build(*command); }};
}

}  // namespace btms
