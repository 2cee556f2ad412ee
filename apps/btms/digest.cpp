// btms digest: the fingerprint of what a map holds, computed again from its content.
#include "engine/model/digest.h"

#include <spdlog/spdlog.h>

#include "apps/btms/command.h"
#include "apps/btms/open_map.h"
#include "apps/btms/report.h"
#include "apps/btms/stop_signal.h"
#include "engine/error.h"

namespace btms {
namespace {

struct DigestCommand {
  CommonOptions common;
  std::string map;
  bool untrusted = false;
};

int run_digest(const DigestCommand& command) {
  const auto map = open_map(command.map, command.untrusted);
  const auto tiles = map->tiles();
  watch_stop_signals();
  const auto threads = make_threads(command.common.thread_count());
  ProgressDisplay progress(command.common.progress_style());
  progress.begin("digest", tiles.size(), "tiles");
  std::vector<Digest> sums(static_cast<std::size_t>(threads->count()));
  threads->for_each(tiles.size(), [&](std::size_t i, int worker) {
    throw_if_stopped();
    if (const auto tile = map->load(tiles[i])) sums[static_cast<std::size_t>(worker)] += digest(*tile);
    progress.advance(1);
  });
  progress.finish();
  Digest total;
  for (const Digest& sum : sums) total += sum;

  const Digest& recorded = map->info().digest;
  const bool match = total == recorded;
  if (command.common.json)
    print_json(Json{{"digest", total.hex()}, {"recorded", recorded.hex()}, {"match", match}, {"tiles", tiles.size()}});
  else
    print_line(total.hex());
  if (match) return 0;
  spdlog::error("{}: the content's digest is {}, but the manifest says {}: the map was changed after it was built",
                command.map, total.hex(), recorded.hex());
  return exit_status(ErrorCode::kVerification);
}

constexpr const char* kDigestFooter =
    "Example:\n"
    "  btms digest city.btms\n"
    "\n"
    "Prints 32 hex digits. Equal digests mean equal models, whatever the tiling, threads or order of inputs were. "
    "Exit\n"
    "status 4 when the content differs from what the map's manifest records.";

}  // namespace

Command add_digest(CLI::App& btms) {
  auto command = std::make_shared<DigestCommand>();
  CLI::App* app = btms.add_subcommand("digest", "Compute a map's fingerprint from its content, and check it");
  app->footer(kDigestFooter);
  app->add_option("MAP", command->map, "A map made by `btms build`")->required()->type_name("");
  add_untrusted_option(*app, command->untrusted);
  add_run_options(*app, command->common);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_digest(*command); }};
}

}  // namespace btms
