#include "apps/btms/rebuild.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <limits>

#include "apps/btms/inputs.h"
#include "apps/btms/reference_system.h"
#include "engine/error.h"
#include "engine/tiling/build.h"
#include "io/points/trajectory.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

// Name, points and bytes of every input are those the manifest has, whatever the folders and the order.
void check_same_inputs(const PointFiles& files, const MapInfo& info) {
  std::vector<const PointFile*> left;
  for (const auto& file : files) left.push_back(file.get());
  for (const InputRecord& input : info.inputs) {
    const auto named = [&](const PointFile* file) { return file->path().filename() == input.name; };
    const auto same = [&](const PointFile* file) {
      return named(file) && file->info().points == input.points && file->info().bytes == input.bytes;
    };
    const auto found = std::find_if(left.begin(), left.end(), same);
    if (found != left.end()) {
      left.erase(found);
      continue;
    }
    const auto changed = std::find_if(left.begin(), left.end(), named);
    if (changed == left.end())
      throw Error(ErrorCode::kBadInput,
                  fmt::format("the map was made of {} too, which is not among --inputs", input.name));
    throw Error(ErrorCode::kBadInput,
                fmt::format("has {} points in {} bytes; the map was made of one of {} points in {} bytes",
                            (*changed)->info().points, (*changed)->info().bytes, input.points, input.bytes),
                (*changed)->path().string());
  }
  if (!left.empty())
    throw Error(ErrorCode::kBadInput, "the map was not made of this input", left.front()->path().string());
}

// As --tile-cells had it: of the coarsest level; an origin of its own has only a map in one tile.
std::int32_t tile_cells_of(const MapInfo& info) {
  const TileGrid& grid = info.layout.grid;
  return grid.origin == Cell{} ? grid.edge_cells >> (level_count(info.parameters) - 1) : 0;
}

}  // namespace

void rebuild_missing(const std::string& map, const Manifest& manifest, const RebuildInputs& inputs,
                     const MemoryOption& memory, const Threads& threads, Progress& progress, MapRepair& repair) {
  const MapInfo& info = manifest.info;
  PointFiles files = open_all(expand_inputs(inputs.points).paths, inputs.options);
  check_same_inputs(files, info);
  if (!info.crs_given) convert_to(files, info.crs_wkt);
  BuildOptions options;
  options.parameters = info.parameters;
  options.tile_cells = tile_cells_of(info);
  options.max_nodes = std::numeric_limits<std::uint64_t>::max();  // it was built once
  options.memory_bytes = memory.limit();
  options.spill_folder = memory.spill_folder(map);
  if (info.trajectory) {
    if (inputs.trajectory.empty())
      throw Error(ErrorCode::kBadInput, fmt::format("the map was made with a trajectory, {}; name it with --trajectory",
                                                    info.trajectory->name));
    options.trajectory = read_trajectory(inputs.trajectory);
    if (options.trajectory.size() != info.trajectory->poses)
      throw Error(
          ErrorCode::kBadInput,
          fmt::format("has {} poses, the map's trajectory had {}", options.trajectory.size(), info.trajectory->poses),
          inputs.trajectory);
  }
  std::vector<const PointSource*> sources;
  for (const auto& file : files) sources.push_back(file.get());
  const auto sink = [&](const MapLayout& layout) -> TileSink& { return repair.sink(layout); };
  build_map(sources, options, threads, *single_rank(), sink, progress);
}

}  // namespace btms
