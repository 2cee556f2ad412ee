// btms diff: where two maps differ, in what, and by how much.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <mutex>
#include <set>

#include "apps/btms/command.h"
#include "apps/btms/open_map.h"
#include "apps/btms/parameter_options.h"
#include "apps/btms/reference_system.h"
#include "apps/btms/report.h"
#include "apps/btms/stop_signal.h"
#include "engine/error.h"
#include "engine/model/difference.h"
#include "engine/query/tile_cache.h"
#include "io/store/map_folder.h"

namespace btms {
namespace {

struct DiffCommand {
  CommonOptions common;
  std::string before, after;
  bool untrusted = false;
};

struct LayerText {
  const char* name;
  double scale;  // value = stored * scale
  const char* unit;
};
// In the order of CompareLayer.
constexpr LayerText kLayers[kCompareLayers] = {
    {"height", 0.001, "m"},    {"weight", 1.0 / 255, ""}, {"count", 1, ""},          {"support", 1.0 / 256, ""},
    {"sd", 0.001, "m"},        {"terrain", 0.001, "m"},   {"roughness", 0.001, "m"}, {"step", 0.001, "m"},
    {"clearance", 0.001, "m"}, {"cost", 1.0 / 254, ""},   {"source_level", 1, ""},   {"upper", 0.001, "m"}};
constexpr const char* kStateNames[kStates] = {"unknown", "observed", "predicted", "obstacle", "filled"};

double greatest(const LayerDifference& layer, const LayerText& text) {
  return tidy(static_cast<double>(layer.most) * text.scale);
}
double mean(const LayerDifference& layer, const LayerText& text) {
  return layer.measured == 0 ? 0
                             : tidy(static_cast<double>(layer.sum) / static_cast<double>(layer.measured) * text.scale);
}

// What was asked of both, where it differs: name, before, after.
using Setting = std::array<std::string, 3>;
std::vector<Setting> different_settings(const MapInfo& a, const MapInfo& b) {
  std::vector<Setting> settings;
  const auto add = [&](const std::string& name, const std::string& x, const std::string& y) {
    if (x != y) settings.push_back({name, x, y});
  };
  const auto crs = [](const MapInfo& info) { return info.crs_wkt.empty() ? "none" : crs_title(info.crs_wkt); };
  add("crs", crs(a), crs(b));
  if (a.crs_wkt != b.crs_wkt && crs(a) == crs(b)) settings.push_back({"crs", "as told", "told otherwise"});
  const auto edge = [](const MapInfo& info) {
    const TileGrid& grid = info.layout.grid;
    return fmt::format("{} squares from {},{}", grid.edge_cells, grid.origin.col, grid.origin.row);
  };
  add("tiles", edge(a), edge(b));
  add("preset", a.preset, b.preset);
  for (const ParameterInfo& parameter : parameter_table())
    add(std::string(parameter.name), parameter_text(a.parameters, parameter), parameter_text(b.parameters, parameter));
  return settings;
}

struct TileDifference {
  TileId id;  // in the tiles of the first map
  Difference difference;
};

struct MapDifference {
  Difference all;
  std::vector<TileDifference> tiles;  // that differ
};

std::set<TileId> tiles_to_compare(const Manifest& before, const Manifest& after) {
  std::set<TileId> ids;
  for (const Manifest* manifest : {&before, &after})
    for (const ShardEntry& shard : manifest->shards)
      for (const TileEntry& tile : shard.tiles)
        before.info.layout.grid.for_each_tile(tile.box, [&](TileId id) { ids.insert(id); });
  return ids;
}

CellBox extent_of(const Manifest& before, const Manifest& after) {
  CellBox extent;
  for (const Manifest* manifest : {&before, &after})
    for (const ShardEntry& shard : manifest->shards) extent = extent.hull(shard.bounds());
  return extent;
}

// Tile by tile of the first map; the second may be cut otherwise.
MapDifference compare(const DiffCommand& command, const Manifest& before, const Manifest& after) {
  const Trust trust = command.untrusted ? Trust::kUntrusted : Trust::kTrusted;
  const TileCache first(MapReader::open(command.before, trust)), second(MapReader::open(command.after, trust));
  const std::set<TileId> wanted = tiles_to_compare(before, after);
  const std::vector<TileId> ids(wanted.begin(), wanted.end());
  const TileGrid &grid = before.info.layout.grid, &other = after.info.layout.grid;
  const CellBox extent = extent_of(before, after);
  const auto threads = make_threads(command.common.thread_count());
  ProgressDisplay progress(command.common.progress_style());
  progress.begin("diff", ids.size(), "tiles");
  MapDifference result;
  std::mutex mutex;
  threads->for_each(ids.size(), [&](std::size_t i, int) {
    throw_if_stopped();
    const CellBox region = grid.box_of(ids[i]).intersect(extent);
    const auto tile = first.load(ids[i]);
    Difference found;
    other.for_each_tile(region, [&](TileId id) {
      const auto counterpart = second.load(id);
      found += difference(tile.get(), counterpart.get(), region.intersect(other.box_of(id)));
    });
    progress.advance(1);
    const std::lock_guard lock(mutex);
    result.all += found;
    if (found.differ > 0) result.tiles.push_back({ids[i], found});
  });
  std::sort(result.tiles.begin(), result.tiles.end(),
            [](const TileDifference& a, const TileDifference& b) { return a.id < b.id; });
  return result;
}

Json layers_json(const Difference& d) {
  Json layers = Json::object();
  for (std::size_t l = 0; l < kCompareLayers; ++l)
    if (d.layers[l].nodes > 0)
      layers[kLayers[l].name] = {{"nodes", d.layers[l].nodes},
                                 {"max", greatest(d.layers[l], kLayers[l])},
                                 {"mean", mean(d.layers[l], kLayers[l])}};
  return layers;
}

template <class Fn>
void each_transition(const Difference& d, Fn&& fn) {
  for (std::size_t from = 0; from < kStates; ++from)
    for (std::size_t to = 0; to < kStates; ++to)
      if (from != to && d.states[from][to] > 0) fn(kStateNames[from], kStateNames[to], d.states[from][to]);
}

Json states_json(const Difference& d) {
  Json states = Json::array();
  each_transition(d, [&](const char* from, const char* to, std::uint64_t nodes) {
    states.push_back({{"from", from}, {"to", to}, {"nodes", nodes}});
  });
  return states;
}

Json settings_json(const std::vector<Setting>& settings) {
  Json json = Json::array();
  for (const auto& [name, a, b] : settings) json.push_back({{"name", name}, {"before", a}, {"after", b}});
  return json;
}

void print_text(const std::vector<Setting>& settings, const MapDifference& result) {
  for (const auto& [name, a, b] : settings) print_line(fmt::format("{}: {} -> {}", name, a, b));
  const Difference& all = result.all;
  if (all.differ == 0) return print_line(fmt::format("equal: {}", counted(all.nodes, "node")));
  TextTable table;
  table.row({"layer", "nodes", "max", "mean", ""});
  for (std::size_t l = 0; l < kCompareLayers; ++l)
    if (const LayerDifference& layer = all.layers[l]; layer.nodes > 0)
      table.row({kLayers[l].name, grouped(layer.nodes), fmt::format("{:.3f}", greatest(layer, kLayers[l])),
                 fmt::format("{:.3f}", mean(layer, kLayers[l])), kLayers[l].unit});
  each_transition(all, [&](const char* from, const char* to, std::uint64_t nodes) {
    table.row({fmt::format("{} -> {}", from, to), grouped(nodes)});
  });
  table.print();
  std::vector<TileDifference> most = result.tiles;
  std::stable_sort(most.begin(), most.end(), [](const TileDifference& a, const TileDifference& b) {
    return a.difference.differ > b.difference.differ;
  });
  constexpr std::size_t kShown = 10;  // --json lists them all
  for (std::size_t i = 0; i < std::min(most.size(), kShown); ++i)
    print_line(fmt::format("tile {},{}: {} of {} differ", most[i].id.tx, most[i].id.ty,
                           grouped(most[i].difference.differ), counted(most[i].difference.nodes, "node")));
  if (most.size() > kShown) print_line(fmt::format("... {} more tiles", most.size() - kShown));
  print_line(fmt::format("{} of {} differ, in {}", grouped(all.differ), counted(all.nodes, "node"),
                         counted(result.tiles.size(), "tile")));
}

int run_diff(const DiffCommand& command) {
  check_is_map(command.before);
  check_is_map(command.after);
  const Manifest before = read_manifest(command.before), after = read_manifest(command.after);
  const std::vector<Setting> settings = different_settings(before.info, after.info);
  if (before.info.layout.lattice != after.info.layout.lattice)
    throw Error(ErrorCode::kVerification,
                fmt::format("squares of {} m and of {} m have no nodes in common: the maps can't be compared",
                            before.info.layout.lattice.resolution_m(), after.info.layout.lattice.resolution_m()));
  watch_stop_signals();
  const MapDifference result = compare(command, before, after);
  if (command.common.json) {
    Json tiles = Json::array();
    for (const TileDifference& tile : result.tiles)
      tiles.push_back({{"tile", {tile.id.tx, tile.id.ty}},
                       {"nodes", tile.difference.differ},
                       {"layers", layers_json(tile.difference)},
                       {"states", states_json(tile.difference)}});
    print_json({{"equal", result.all.differ == 0},
                {"nodes", result.all.nodes},
                {"differ", result.all.differ},
                {"settings", settings_json(settings)},
                {"layers", layers_json(result.all)},
                {"states", states_json(result.all)},
                {"tiles", tiles}});
  } else {
    print_text(settings, result);
  }
  return result.all.differ == 0 ? 0 : exit_status(ErrorCode::kVerification);
}

constexpr const char* kDiffFooter =
    "Examples:\n"
    "  btms diff monday.btms tuesday.btms\n"
    "  btms diff coarse.btms fine.btms --json\n"
    "\n"
    "Exit status 0: the same terrain, 4: not. Tiles may be cut differently in the two maps; squares of another size\n"
    "can't be compared. A layer counts the nodes where it differs, where both maps have a surface; max and mean are\n"
    "absolute differences of those (for height of a node's corners, for upper of its further surfaces). `a -> b` "
    "counts\n"
    "the nodes whose state went from a to b. Settings that differ are told, and are no difference by themselves.";

}  // namespace

Command add_diff(CLI::App& btms) {
  auto command = std::make_shared<DiffCommand>();
  CLI::App* app = btms.add_subcommand("diff", "Say where two maps differ, in what and by how much");
  app->footer(kDiffFooter);
  app->add_option("BEFORE", command->before, "A map made by `btms build`")->required()->type_name("");
  app->add_option("AFTER", command->after, "Another")->required()->type_name("");
  add_untrusted_option(*app, command->untrusted);
  add_run_options(*app, command->common);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_diff(*command); }};
}

}  // namespace btms
