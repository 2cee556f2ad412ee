#include "apps/btms/open_map.h"

#include "engine/error.h"
#include "io/store/map_folder.h"

namespace btms {

std::unique_ptr<MapReader> open_map(const std::string& path) {
  namespace fs = std::filesystem;
  if (!fs::exists(path)) throw Error(ErrorCode::kUsage, "there is no such map", path);
  if (!fs::is_directory(path))
    throw Error(ErrorCode::kBadInput, "not a map: a map is a folder made by `btms build`", path);
  if (!fs::exists(fs::path(path) / kManifest))
    throw Error(ErrorCode::kBadInput, std::string("not a map: no ") + kManifest + " in it", path);
  return MapReader::open(path);
}

}  // namespace btms
