// btms join: how far the parts of a job array are; tidies up once their map is there.
#include <spdlog/fmt/fmt.h>

#include "apps/btms/command.h"
#include "apps/btms/continuation.h"
#include "apps/btms/report.h"
#include "engine/error.h"
#include "io/store/journal.h"
#include "io/store/map_folder.h"
#include "io/store/part_ranks.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

struct JoinCommand {
  CommonOptions common;
  std::string map;
};

// The map that the parts were to build, once it is published. Inputs may have been touched since.
std::optional<MapInfo> published_map(const std::string& map, const PartsState& state) {
  const auto manifest = read_manifest_of(map);
  if (!manifest) return {};
  const std::string difference = identity_difference(state.identity, stored_identity(manifest->info));
  return difference.empty() ? std::optional(manifest->info) : std::nullopt;
}

int run_join(const JoinCommand& command) {
  const fs::path folder = parts_folder(command.map);
  if (!fs::exists(folder)) {
    if (const auto manifest = read_manifest_of(command.map)) {
      if (command.common.json)
        print_json(Json{{"map", command.map}, {"finished", true}, {"digest", manifest->info.digest.hex()}});
      else
        print_line(fmt::format("done: {}, digest {}", command.map, manifest->info.digest.hex()));
      return 0;
    }
    throw Error(ErrorCode::kUsage, "no part has begun: btms build INPUT... -o MAP --part 1/N", folder.string());
  }
  const PartsState state = read_parts(folder);
  const auto map = published_map(command.map, state);
  if (map) remove_parts(folder);
  if (command.common.json) {
    Json json{{"map", command.map}, {"finished", map.has_value()}, {"parts", state.parts}, {"reached", state.reached}};
    if (map) json["digest"] = map->digest.hex();
    print_json(json);
  } else if (map) {
    print_line(fmt::format("done: {} of {}, digest {}", command.map,
                           counted(static_cast<std::size_t>(state.parts), "part"), map->digest.hex()));
  } else {
    for (std::size_t i = 0; i < state.reached.size(); ++i)
      print_line(fmt::format("part {}: {}", i + 1, state.reached[i].empty() ? "has not begun" : state.reached[i]));
    print_line("run the parts again");
  }
  return map ? 0 : exit_status(ErrorCode::kUnfinished);
}

constexpr const char* kJoinFooter =
    "Example: three parts, one after another (at once they need one turn, with a --wait that is long enough)\n"
    "  until btms join city.btms; do\n"
    "    for i in 1 2 3; do btms build tiles/ -o city.btms --part $i/3; done\n"
    "  done\n"
    "\n"
    "Exit status: 0 the map is there (what the parts told each other, MAP.parts, is removed), 5 the parts have to run\n"
    "again, 2 there are none.";

}  // namespace

Command add_join(CLI::App& btms) {
  auto command = std::make_shared<JoinCommand>();
  CLI::App* app = btms.add_subcommand("join", "Say whether the parts of a job array have built their map");
  app->footer(kJoinFooter);
  app->add_option("MAP", command->map, "What the parts were given as --output")->required()->type_name("");
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_join(*command); }};
}

}  // namespace btms
