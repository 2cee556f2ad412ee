// btms info: what a point file or a map is.
#include "apps/btms/info.h"

#include "apps/btms/command.h"
#include "apps/btms/inputs.h"
#include "apps/btms/open_map.h"
#include "engine/error.h"

namespace btms {
namespace {

struct InfoCommand {
  CommonOptions common;
  PointFileOptions points;
  std::string path;
  bool untrusted = false;
};

int run_info(const InfoCommand& command) {
  std::error_code ignored;  // of links in a circle: the reader says what is wrong with them
  if (!std::filesystem::exists(std::filesystem::symlink_status(command.path, ignored)))
    throw Error(ErrorCode::kUsage, "there is no such file or map", command.path);
  if (std::filesystem::is_directory(command.path, ignored))
    print_map(command.path, command.untrusted, command.common.json, *make_threads(command.common.thread_count()));
  else
    print_point_file(command.path, command.points, command.common.json);
  return 0;
}

constexpr const char* kInfoFooter =
    "Examples:\n"
    "  btms info tile.las\n"
    "  btms info city.btms --json\n"
    "\n"
    "A LAS file is taken at its header's word; files of other formats, which declare no extent, and maps are "
    "read whole.";

}  // namespace

Command add_info(CLI::App& btms) {
  auto command = std::make_shared<InfoCommand>();
  CLI::App* app = btms.add_subcommand("info", "Say what a point file or a map is");
  app->footer(kInfoFooter);
  app->add_option("PATH", command->path, "A point file, or a map made by `btms build`")->required()->type_name("");
  add_columns_option(*app, command->points);
  add_untrusted_option(*app, command->untrusted);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_info(*command); }};
}

}  // namespace btms
