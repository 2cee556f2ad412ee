#include "apps/btms/open_map.h"

#include "engine/error.h"
#include "io/store/map_folder.h"

namespace btms {

void add_untrusted_option(CLI::App& app, bool& untrusted) {
  app.add_flag("--untrusted", untrusted,
               "The map is a stranger's: parse its shards in child processes that can do nothing else");
}

void check_is_map(const std::string& path) {
  namespace fs = std::filesystem;
  if (!fs::exists(path)) throw Error(ErrorCode::kUsage, "there is no such map", path);
  if (!fs::is_directory(path))
    throw Error(ErrorCode::kBadInput, "not a map: a map is a folder made by `btms build`", path);
  if (!fs::exists(fs::path(path) / kManifest))
    throw Error(ErrorCode::kBadInput, std::string("not a map: no ") + kManifest + " in it", path);
}

std::unique_ptr<MapReader> open_map(const std::string& path, bool untrusted) {
  check_is_map(path);
  return MapReader::open(path, untrusted ? Trust::kUntrusted : Trust::kTrusted);
}

}  // namespace btms
