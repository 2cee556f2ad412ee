// btms verify: whether a map is all that its manifest says, and how to make it so again.
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "apps/btms/command.h"
#include "apps/btms/continuation.h"
#include "apps/btms/inputs.h"
#include "apps/btms/open_map.h"
#include "apps/btms/process_group.h"
#include "apps/btms/rebuild.h"
#include "apps/btms/report.h"
#include "apps/btms/run_plan.h"
#include "apps/btms/stop_signal.h"
#include "engine/error.h"
#include "io/store/map_check.h"
#include "io/store/map_folder.h"
#include "io/store/map_repair.h"

namespace btms {
namespace {

struct VerifyCommand {
  CommonOptions common;
  std::string map;
  bool untrusted = false, repair = false;
  RebuildInputs inputs;
  MemoryOption memory;
};

// What --repair did.
struct Repair {
  std::vector<std::string> done;  // a sentence each
  std::string obstacle;           // why what is left is left; or empty
};

std::size_t tile_count(const Manifest& manifest) {
  std::size_t n = 0;
  for (const ShardEntry& shard : manifest.shards) n += shard.tiles.size();
  return n;
}

MapCheck check_with_progress(const VerifyCommand& command, const Manifest& manifest, const Threads& threads,
                             Ranks& ranks) {
  ProgressDisplay progress(ranks.rank() == 0 ? command.common.progress_style() : ProgressStyle::kNone);
  return check_map(command.map, manifest, command.untrusted ? Trust::kUntrusted : Trust::kTrusted, threads, ranks,
                   progress);
}

// From what is left of the damaged files first, then from the inputs.
Repair repair_map(const VerifyCommand& command, const Manifest& manifest, const MapCheck& check,
                  const Threads& threads) {
  Repair result;
  MapRepair repair(command.map, manifest, check);
  const auto name_of = [&](std::size_t s) { return fmt::format("{}/{}", kShardFolder, manifest.shards[s].file); };
  const auto damaged = repair.missing();
  for (const std::size_t s : damaged) {
    throw_if_stopped();
    const auto content = salvage_shard(command.map, manifest, s);
    if (content && repair.put_back(s, *content))
      result.done.push_back(name_of(s) + ": restored, its values could still be read");
  }
  const auto wanted = repair.missing();
  RebuildInputs inputs = command.inputs;
  if (inputs.points.empty())
    for (const InputRecord& input : manifest.info.inputs)
      if (const std::filesystem::path path = input_path(input, command.map); std::filesystem::exists(path))
        inputs.points.push_back(path.string());
  if (!wanted.empty() && inputs.points.empty()) {
    result.obstacle = fmt::format(
        "{} can only be rebuilt from the map's inputs, which are not there any more: name them with --inputs",
        counted(wanted.size(), "shard"));
  } else if (!wanted.empty()) {
    try {
      ProgressDisplay progress(command.common.progress_style(), build_plan(manifest.info.parameters));
      rebuild_missing(command.map, manifest, inputs, command.memory, threads, progress, repair);
      if (!repair.missing().empty())
        result.obstacle = "a build from these inputs gives other values: their content, or the program, has changed";
    } catch (const Error& e) {
      if (e.code() == ErrorCode::kCancelled) throw;
      result.obstacle = e.what();
    }
    for (const std::size_t s : wanted)
      if (!repair.missing().contains(s)) result.done.push_back(name_of(s) + ": rebuilt from the inputs");
  }
  repair.finish();
  if (!check.has_view) result.done.push_back(std::string(kMapNc) + ": written again");
  return result;
}

Json problems_json(const std::vector<MapProblem>& problems) {
  Json all = Json::array();
  for (const MapProblem& problem : problems) {
    Json tiles = Json::array();
    for (const TileId id : problem.tiles) tiles.push_back({id.tx, id.ty});
    all.push_back({{"file", problem.file}, {"tiles", tiles}, {"what", problem.what}});
  }
  return all;
}

void print_problems(const std::vector<MapProblem>& problems) {
  for (const MapProblem& p : problems)
    print_line(p.tiles.empty() ? fmt::format("{}: {}", p.file, p.what)
                               : fmt::format("{}: tile{} {}: {}", p.file, p.tiles.size() == 1 ? "" : "s",
                                             tiles_text(p.tiles), p.what));
}

// `first` is what was found, `last` what is left after a repair, if there was one.
void print_check(const VerifyCommand& command, const Manifest& manifest, const MapCheck& first,
                 const std::optional<Repair>& repair, const MapCheck& last) {
  if (command.common.json) {
    Json json{{"map", command.map},
              {"sound", last.problems.empty()},
              {"revision", manifest.info.revision},
              {"digest", manifest.info.digest.hex()},
              {"tiles", tile_count(manifest)},
              {"shards", manifest.shards.size()},
              {"bytes", last.bytes},
              {"problems", problems_json(first.problems)},
              {"stray", last.strays}};
    if (repair) {
      json["repaired"] = repair->done;
      json["left"] = problems_json(last.problems);
      if (!repair->obstacle.empty()) json["obstacle"] = repair->obstacle;
    }
    return print_json(json);
  }
  print_problems(first.problems);
  if (repair) {
    for (const std::string& done : repair->done) print_line(done);
    if (!repair->obstacle.empty()) print_line("not repaired: " + repair->obstacle);
    if (!last.problems.empty()) print_line("left:");
    print_problems(last.problems);
  }
  for (const std::string& stray : last.strays) print_line(stray + ": not part of the map");
  print_line(fmt::format("{}: {} in {}, {}, digest {}",
                         last.problems.empty() ? "sound" : counted(last.problems.size(), "problem"),
                         counted(tile_count(manifest), "tile"), counted(manifest.shards.size(), "shard"),
                         bytes_text(last.bytes), manifest.info.digest.hex()));
}

Manifest manifest_of(const VerifyCommand& command) {
  check_is_map(command.map);
  try {
    return read_manifest(command.map);
  } catch (const Error& e) {
    if (!command.repair) throw;
    throw Error(e.code(), fmt::format("{}; it can't be repaired: parameters and the list of inputs are in this file "
                                      "alone. Build the map again, or take the file from a copy",
                                      e.what()));
  }
}

// The newest one, the same on every rank, although a build may publish the next meanwhile.
Manifest agreed_manifest(const VerifyCommand& command, Ranks& ranks) {
  for (;;) {
    Manifest manifest = manifest_of(command);
    const auto revisions = ranks.gather(std::vector{manifest.info.revision});
    if (std::ranges::count(revisions, revisions.front()) == std::ssize(revisions)) return manifest;
  }
}

struct Checked {
  Manifest manifest;
  MapCheck found;
};

// Problems of a map whose next revision is there, which has removed shards of this one, are none: that is the map now.
Checked check_newest(const VerifyCommand& command, const Threads& threads, Ranks& ranks) {
  for (;;) {
    Checked checked{agreed_manifest(command, ranks), {}};
    checked.found = check_with_progress(command, checked.manifest, threads, ranks);
    if (checked.found.problems.empty()) return checked;
    const bool is_old = published_revision(command.map) > checked.manifest.info.revision;
    const auto any_old = ranks.gather(std::vector<std::uint8_t>{is_old});
    if (std::ranges::count(any_old, 1) == 0) return checked;
  }
}

int run_verify(const VerifyCommand& command) {
  watch_stop_signals();
  Checked checked;
  run_on_ranks(1, [&](Ranks& ranks) {
    const auto threads = make_threads(std::max(1, command.common.thread_count() / processes_here(1)));
    checked = check_newest(command, *threads, ranks);
  });
  const bool sound = checked.found.problems.empty();
  if (!is_first_process()) return sound ? 0 : exit_status(ErrorCode::kVerification);
  MapCheck last = checked.found;
  std::optional<Repair> repair;
  if (command.repair && !sound) {
    const auto threads = make_threads(command.common.thread_count());
    repair = repair_map(command, checked.manifest, checked.found, *threads);
    checked.manifest = read_manifest(command.map);
    last = check_with_progress(command, checked.manifest, *threads, *single_rank());
  }
  print_check(command, checked.manifest, checked.found, repair, last);
  return last.problems.empty() ? 0 : exit_status(ErrorCode::kVerification);
}

constexpr const char* kVerifyFooter =
    "Examples:\n"
    "  btms verify city.btms\n"
    "  btms verify city.btms --repair                     # and --inputs tiles/ where they have moved\n"
    "  btms verify download.btms --untrusted --json\n"
    "\n"
    "Every problem is a line that names the file and its tiles. Compared are: the manifest with its own hash; of "
    "every\n"
    "shard size, hash, structure, axes, reference system, values and digest, and what is derived from the model with\n"
    "the model; heights on both sides of every border; map.nc with the shards. Exit status 0: sound (now), 4: not,\n"
    "3: not a map at all.\n"
    "\n"
    "--repair writes map.nc again, restores shards whose values can still be read (damage to what is derived from\n"
    "them), and builds the others again from the inputs; a shard is only replaced by one with the very values the\n"
    "manifest states. A damaged manifest can't be repaired. With --untrusted a shard that was made to break its "
    "reader\n"
    "breaks a child process that can do nothing, and is one of the problems.";

}  // namespace

Command add_verify(CLI::App& btms) {
  auto command = std::make_shared<VerifyCommand>();
  CLI::App* app = btms.add_subcommand("verify", "Check that a map is whole and undamaged, and repair it");
  app->footer(kVerifyFooter);
  app->add_option("MAP", command->map, "A map made by `btms build`")->required()->type_name("");
  CLI::Option* repair = app->add_flag("--repair", command->repair, "Put back what is damaged or missing");
  app->add_option("--inputs", command->inputs.points,
                  "Where the point files the map was made of are now, when they have moved: damaged shards are rebuilt "
                  "from them")
      ->needs(repair)
      ->default_str("")
      ->type_name("FILE...");
  add_columns_option(*app, command->inputs.options);
  app->add_option("--trajectory", command->inputs.trajectory, "The trajectory the map was made with")
      ->needs(repair)
      ->default_str("")
      ->type_name("FILE");
  add_untrusted_option(*app, command->untrusted);
  command->memory.add_to(*app, true);
  add_run_options(*app, command->common);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_verify(*command); }};
}

}  // namespace btms
