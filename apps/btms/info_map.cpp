#include <spdlog/fmt/fmt.h>

#include <limits>

#include "apps/btms/build_report.h"
#include "apps/btms/info.h"
#include "apps/btms/open_map.h"
#include "apps/btms/parameter_options.h"
#include "apps/btms/reference_system.h"

namespace btms {
namespace {

// What only the tiles know.
struct Content {
  CellBox cells;  // with anything in them
  std::array<std::uint64_t, 5> nodes{};
  std::uint64_t reachable = 0, detached = 0;  // further surfaces, a node each
  std::int32_t low_mm = std::numeric_limits<std::int32_t>::max(), high_mm = std::numeric_limits<std::int32_t>::min();

  std::uint64_t of(NodeState state) const { return nodes[static_cast<std::size_t>(state)]; }
  bool has_surface() const { return low_mm <= high_mm; }

  void add(const TerrainTile& tile) {
    cells = cells.hull(tile.box);
    for (const NodeSurface& node : tile.nodes)
      if (node.state != NodeState::kUnknown || node.count > 0) ++nodes[static_cast<std::size_t>(node.state)];
    for (const UpperNode& u : tile.upper) ++(u.kind == UpperKind::kReachable ? reachable : detached);
    for (const auto* heights : {&tile.corner_mm, &tile.centre_mm})
      for (const std::int32_t mm : *heights)
        if (mm != kUnknownHeight_mm) {
          low_mm = std::min(low_mm, mm);
          high_mm = std::max(high_mm, mm);
        }
  }
  void add(const Content& other) {
    cells = cells.hull(other.cells);
    for (std::size_t s = 0; s < nodes.size(); ++s) nodes[s] += other.nodes[s];
    reachable += other.reachable;
    detached += other.detached;
    low_mm = std::min(low_mm, other.low_mm);
    high_mm = std::max(high_mm, other.high_mm);
  }
};

Content content_of(const TileSource& map, const Threads& threads) {
  const auto tiles = map.tiles();
  std::vector<Content> parts(static_cast<std::size_t>(threads.count()));
  threads.for_each(tiles.size(), [&](std::size_t i, int worker) {
    if (const auto tile = map.load(tiles[i])) parts[static_cast<std::size_t>(worker)].add(*tile);
  });
  Content all;
  for (const Content& part : parts) all.add(part);
  return all;
}

}  // namespace

void print_map(const std::string& path, bool untrusted, bool as_json, const Threads& threads) {
  const auto map = open_map(path, untrusted);
  const MapInfo& info = map->info();
  const std::size_t tiles = map->tiles().size();
  const Content content = content_of(*map, threads);
  const double r = info.layout.lattice.resolution_m();
  const double west = content.cells.col0 * r, south = content.cells.row0 * r;
  const double east = content.cells.col1 * r, north = content.cells.row1 * r;
  const double low = content.low_mm / 1000.0, high = content.high_mm / 1000.0;
  const std::uint64_t observed = content.of(NodeState::kObserved), predicted = content.of(NodeState::kPredicted);
  const std::uint64_t obstacle = content.of(NodeState::kObstacle), filled = content.of(NodeState::kFilled);
  const std::uint64_t unknown = content.of(NodeState::kUnknown);
  if (as_json) {
    Json inputs = Json::array();
    for (const InputRecord& input : info.inputs)
      inputs.push_back({{"name", input.name}, {"points", input.points}, {"bytes", input.bytes}});
    Json json{{"kind", "map"}, {"path", path}};
    json["digest"] = info.digest.hex();
    json["revision"] = info.revision;
    json["points"] = info.points;
    json["dropped"] = info.dropped;
    json["tiles"] = tiles;
    json["tile_cells"] = info.layout.grid.edge_cells;
    json["resolution_m"] = r;
    json["bounds_m"] = {tidy(west), tidy(south), tidy(east), tidy(north)};
    json["heights_m"] = content.has_surface() ? Json{low, high} : Json();
    json["nodes"] = {{"observed", observed},
                     {"predicted", predicted},
                     {"obstacle", obstacle},
                     {"filled", filled},
                     {"unknown", unknown}};
    json["upper"] = {{"reachable", content.reachable}, {"detached", content.detached}};
    json["crs"] = info.crs_wkt;
    json["preset"] = info.preset;
    json["parameters"] = parameters_json(info.parameters);
    json["inputs"] = inputs;
    json["trajectory"] = trajectory_json(info.trajectory);
    return print_json(json);
  }
  TextTable table(TextTable::Align::kLeft);
  table.row({"format", fmt::format("B-TMS map, revision {}", info.revision)});
  table.row({"digest", info.digest.hex()});
  table.row({"points", fmt::format("{} from {}, {} dropped", grouped(info.points), counted(info.inputs.size(), "file"),
                                   grouped(info.dropped))});
  constexpr std::size_t kInputsShown = 10;  // --json lists them all
  for (std::size_t i = 0; i < std::min(info.inputs.size(), kInputsShown); ++i)
    table.row({"input", fmt::format("{}, {}", info.inputs[i].name, counted(info.inputs[i].points, "point"))});
  if (info.inputs.size() > kInputsShown) table.row({"", fmt::format("... {} more", info.inputs.size() - kInputsShown)});
  if (info.trajectory) table.row({"trajectory", trajectory_text(*info.trajectory)});
  table.row({"x", fmt::format("{:.3f} to {:.3f} m", west, east)});
  table.row({"y", fmt::format("{:.3f} to {:.3f} m", south, north)});
  table.row({"z", content.has_surface() ? fmt::format("{:.3f} to {:.3f} m", low, high) : "no surface anywhere"});
  table.row({"nodes", fmt::format("{} observed, {} predicted, {} obstacle, {} filled, {} unknown", grouped(observed),
                                  grouped(predicted), grouped(obstacle), grouped(filled), grouped(unknown))});
  table.row({"upper", fmt::format("{} reachable, {} detached nodes of further surfaces", grouped(content.reachable),
                                  grouped(content.detached))});
  table.row({"tiles", fmt::format("{} of {} x {} squares of {} m", grouped(tiles), info.layout.grid.edge_cells,
                                  info.layout.grid.edge_cells, r)});
  table.row({"crs", crs_title(info.crs_wkt)});
  table.row({"preset", info.preset});
  for (const ParameterInfo& parameter : parameter_table())
    table.row({std::string(parameter.name),
               fmt::format("{} {}", parameter_text(info.parameters, parameter), parameter.unit)});
  table.print();
}

}  // namespace btms
