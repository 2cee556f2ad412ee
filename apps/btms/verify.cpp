// btms verify: whether a map is all that its manifest says.
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include "apps/btms/command.h"
#include "apps/btms/open_map.h"
#include "apps/btms/report.h"
#include "apps/btms/stop_signal.h"
#include "engine/error.h"
#include "io/store/map_check.h"
#include "io/store/map_folder.h"

namespace btms {
namespace {

struct VerifyCommand {
  CommonOptions common;
  std::string map;
  bool untrusted = false;
};

std::size_t tile_count(const Manifest& manifest) {
  std::size_t n = 0;
  for (const ShardEntry& shard : manifest.shards) n += shard.tiles.size();
  return n;
}

Json problem_json(const MapProblem& problem) {
  Json tiles = Json::array();
  for (const TileId id : problem.tiles) tiles.push_back({id.tx, id.ty});
  return {{"file", problem.file}, {"tiles", tiles}, {"what", problem.what}};
}

std::string problem_text(const MapProblem& problem) {
  if (problem.tiles.empty()) return fmt::format("{}: {}", problem.file, problem.what);
  return fmt::format("{}: tile{} {}: {}", problem.file, problem.tiles.size() == 1 ? "" : "s", tiles_text(problem.tiles),
                     problem.what);
}

void print_check(const VerifyCommand& command, const Manifest& manifest, const MapCheck& check) {
  if (command.common.json) {
    Json problems = Json::array();
    for (const MapProblem& problem : check.problems) problems.push_back(problem_json(problem));
    return print_json({{"map", command.map},
                       {"sound", check.problems.empty()},
                       {"revision", manifest.info.revision},
                       {"digest", manifest.info.digest.hex()},
                       {"tiles", tile_count(manifest)},
                       {"shards", manifest.shards.size()},
                       {"bytes", check.bytes},
                       {"problems", problems},
                       {"stray", check.strays}});
  }
  for (const MapProblem& problem : check.problems) print_line(problem_text(problem));
  for (const std::string& stray : check.strays) print_line(stray + ": not part of the map");
  const std::string what =
      fmt::format("{} in {}, {}, digest {}", counted(tile_count(manifest), "tile"),
                  counted(manifest.shards.size(), "shard"), bytes_text(check.bytes), manifest.info.digest.hex());
  print_line(check.problems.empty() ? "sound: " + what : counted(check.problems.size(), "problem") + " found: " + what);
}

int run_verify(const VerifyCommand& command) {
  check_is_map(command.map);
  const Manifest manifest = read_manifest(command.map);
  watch_stop_signals();
  const auto threads = make_threads(command.common.thread_count());
  ProgressDisplay progress(command.common.progress_style());
  const MapCheck check =
      check_map(command.map, manifest, command.untrusted ? Trust::kUntrusted : Trust::kTrusted, *threads, progress);
  progress.finish();
  print_check(command, manifest, check);
  return check.problems.empty() ? 0 : exit_status(ErrorCode::kVerification);
}

constexpr const char* kFooter =
    "Examples:\n"
    "  btms verify city.btms\n"
    "  btms verify download.btms --untrusted --json\n"
    "\n"
    "Every problem is a line that names the file and its tiles. Compared are: the manifest with its own hash; of "
    "every\n"
    "shard size, hash, structure, axes, reference system, values and digest, and what is derived from the model with\n"
    "the model; heights on both sides of every border; map.nc with the shards. Exit status 0: sound, 4: not, 3: not a\n"
    "map at all. With --untrusted a shard that was made to break its reader breaks a child process that can do\n"
    "nothing, and is one of the problems.";

}  // namespace

Command add_verify(CLI::App& btms) {
  auto command = std::make_shared<VerifyCommand>();
  CLI::App* app = btms.add_subcommand("verify", "Check that a map is whole and undamaged");
  app->footer(kFooter);
  app->add_option("MAP", command->map, "A map made by `btms build`")->required()->type_name("");
  add_untrusted_option(*app, command->untrusted);
  add_run_options(*app, command->common);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_verify(*command); }};
}

}  // namespace btms
