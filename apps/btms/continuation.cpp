#include "apps/btms/continuation.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <fstream>

#include "engine/error.h"
#include "io/files/content_print.h"
#include "io/store/journal.h"
#include "io/store/map_folder.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code ignored;
  return fs::equivalent(a, b, ignored);
}

bool same_bytes(const fs::path& a, const fs::path& b) {
  if (fs::file_size(a) != fs::file_size(b) || content_print(a).text != content_print(b).text) return false;
  std::ifstream one(a, std::ios::binary), other(b, std::ios::binary);
  std::vector<char> x(1 << 20), y(1 << 20);
  while (one && other) {
    one.read(x.data(), static_cast<std::streamsize>(x.size()));
    other.read(y.data(), static_cast<std::streamsize>(y.size()));
    if (one.gcount() != other.gcount() || !std::equal(x.begin(), x.begin() + one.gcount(), y.begin())) return false;
  }
  return one.eof() && other.eof();
}

}  // namespace

InputList updated_inputs(const MapInfo& map, const fs::path& folder, const ContinuationRequest& request,
                         const InputList& added) {
  InputList out;
  out.warnings = added.warnings;
  std::vector<std::string> unknown = request.removed;
  for (const std::string& name : request.removed)
    if (std::count_if(map.inputs.begin(), map.inputs.end(), [&](const InputRecord& in) { return in.name == name; }) > 1)
      throw Error(ErrorCode::kUsage, "--remove " + name + ": the map has several inputs of this name; build it anew",
                  folder.string());
  for (const InputRecord& in : map.inputs) {
    if (std::find(request.removed.begin(), request.removed.end(), in.name) != request.removed.end()) {
      std::erase(unknown, in.name);
      continue;
    }
    const auto replaces = [&](const fs::path& p) { return p.filename() == in.name; };
    if (request.replace && std::any_of(added.paths.begin(), added.paths.end(), replaces)) continue;
    const fs::path path = input_path(in, folder);
    if (path.empty() || !fs::exists(path))
      throw Error(ErrorCode::kUsage,
                  "the map's input " + in.name +
                      " is not there any more; bring it back, take it out of the map with "
                      "--remove " +
                      in.name + ", or build the map anew",
                  path.string());
    if (!in.content.empty() && content_print(path).text != in.content)
      out.warnings.push_back(in.name + " is not what it was when the map was built; it is read anew");
    out.paths.push_back(path);
  }
  if (!unknown.empty())
    throw Error(ErrorCode::kUsage, "--remove " + unknown[0] + ": the map has no input of this name", folder.string());
  for (const fs::path& path : added.paths) {
    const auto there = [&](const fs::path& p) { return same_file(p, path) || same_bytes(p, path); };
    if (std::any_of(out.paths.begin(), out.paths.end(), there))
      out.warnings.push_back(path.filename().string() + " is in the map already");
    else
      out.paths.push_back(path);
  }
  if (out.paths.empty()) throw Error(ErrorCode::kUsage, "nothing would be left of the map", folder.string());
  return out;
}

fs::path input_path(const InputRecord& input, const fs::path& folder) {
  const fs::path path = input.path;
  return path.empty() || path.is_absolute() ? path : (folder / path).lexically_normal();
}

InputRecord input_record(const PointFile& file, const fs::path& folder) {
  const ContentPrint print = content_print(file.path());
  const fs::path whole = fs::absolute(file.path()).lexically_normal();
  const fs::path from_folder = whole.lexically_relative(fs::absolute(folder).lexically_normal());
  return {.name = file.path().filename().string(),
          .points = file.info().points,
          .bytes = file.info().bytes,
          .path = (from_folder.empty() ? whole : from_folder).string(),
          .content = print.text,
          .changed_ns = print.changed_ns};
}

std::string stored_identity(MapInfo info) {
  for (InputRecord& in : info.inputs) in.changed_ns = 0;
  return build_identity(info);
}

Continuation continuation(const fs::path& folder, const MapInfo& wanted, const ContinuationRequest& request) {
  Continuation out;
  const auto published = read_manifest_of(folder);
  if (published) out.revision = published->info.revision + 1;
  const bool has_rounds = wanted.parameters.method == Method::kCoarseToFine;
  if (has_rounds && (request.update || request.updatable)) out.since = out.revision;
  if (!has_rounds && (request.update || request.updatable))
    spdlog::warn("the fixed method has no rounds to remember: updates of this map work out all of it");
  if (has_rounds && request.update) {
    const MapInfo& map = published->info;
    out.follow = map.updatable_since > 0 && map.layout.grid.edge_cells == wanted.layout.grid.edge_cells &&
                 map.layout.grid.origin == Cell{} && map.crs_wkt == wanted.crs_wkt;
    if (out.follow) {
      out.since = map.updatable_since;
      out.round_files = map.round_files;
    } else {
      spdlog::warn("all of the map is worked out once more: {}",
                   map.updatable_since == 0 ? "it doesn't remember its rounds yet"
                                            : "its tiles or its reference system are others now");
    }
  }
  if (!request.resume) return out;

  const std::string identity = build_identity(wanted);
  if (const auto interrupted = read_journals(folder); interrupted && interrupted->revision == out.revision) {
    if (const std::string what = identity_difference(interrupted->identity, identity); !what.empty())
      throw Error(ErrorCode::kUsage,
                  "the interrupted build there was another one (" + what +
                      "); leave out --resume to begin afresh, or choose another name",
                  folder.string());
    out.resume = true;
  } else if (published && !request.update) {
    const std::string what = identity_difference(stored_identity(published->info), stored_identity(wanted));
    if (!what.empty())
      throw Error(ErrorCode::kUsage,
                  "the map there is finished, but another one (" + what +
                      "); leave out --resume to build it anew, or see --update",
                  folder.string());
    out.finished = true;
  }
  return out;
}

}  // namespace btms
