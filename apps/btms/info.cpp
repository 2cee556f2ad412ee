// btms info: what a point file or a map says of itself.
#include <spdlog/fmt/fmt.h>

#include "apps/btms/command.h"
#include "apps/btms/inputs.h"
#include "apps/btms/parameter_options.h"
#include "io/store/map_store.h"

namespace btms {
namespace {

struct InfoCommand {
  CommonOptions common;
  std::string path;
};

// The name in a WKT text, with its EPSG code where it ends in one; other text as it is. JSON has it all.
std::string crs_title(const std::string& text) {
  if (text.empty()) return "not named";
  const std::size_t open = text.find('"'), close = text.find('"', open + 1);
  if (close == std::string::npos) return text;
  std::string title = text.substr(open + 1, close - open - 1);
  constexpr std::string_view kId = "ID[\"EPSG\",";
  const std::size_t id = text.rfind(kId), end = text.find(']', id);
  if (id != std::string::npos && end + 2 == text.size())
    title += " (EPSG:" + text.substr(id + kId.size(), end - id - kId.size()) + ")";
  return title;
}

void print_point_file(const std::string& path, bool as_json) {
  const auto file = open_points(path);
  const PointFileInfo& info = file->info();
  if (as_json) {
    Json json{{"kind", "points"}};
    json.update(input_json(*file));
    json["crs"] = info.crs;
    if (info.declared_bounds_m) json["declared_bounds_m"] = *info.declared_bounds_m;
    return print_json(json);
  }
  TextTable table(TextTable::Align::kLeft);
  table.row({"format", info.format});
  table.row({"points", grouped(info.points)});
  table.row({"size", bytes_text(info.bytes)});
  if (const auto& b = info.declared_bounds_m) {
    constexpr const char* kAxes[] = {"x", "y", "z"};
    for (std::size_t a = 0; a < 3; ++a)
      table.row({kAxes[a], fmt::format("{:.3f} to {:.3f} m, says the header", (*b)[a], (*b)[a + 3])});
  }
  table.row({"crs", crs_title(info.crs)});
  for (const std::string& warning : info.warnings) table.row({"warning", warning});
  table.print();
}

void print_map(const std::string& path, bool as_json) {
  const auto map = MapReader::open(path);
  const MapInfo& info = map->info();
  const auto tiles = map->tiles();
  CellBox cells;
  for (const TileId tile : tiles) cells = cells.hull(info.layout.grid.box_of(tile));
  const double r = info.layout.lattice.resolution_m();
  const double west = cells.col0 * r, south = cells.row0 * r, east = cells.col1 * r, north = cells.row1 * r;
  if (as_json) {
    Json inputs = Json::array();
    for (const InputRecord& input : info.inputs)
      inputs.push_back({{"name", input.name}, {"points", input.points}, {"bytes", input.bytes}});
    Json json{{"kind", "map"}, {"path", path}};
    json["digest"] = info.digest.hex();
    json["revision"] = info.revision;
    json["points"] = info.points;
    json["dropped"] = info.dropped;
    json["tiles"] = tiles.size();
    json["tile_cells"] = info.layout.grid.edge_cells;
    json["resolution_m"] = r;
    json["bounds_m"] = {west, south, east, north};
    json["crs"] = info.crs_wkt;
    json["preset"] = info.preset;
    json["parameters"] = parameters_json(info.parameters);
    json["inputs"] = inputs;
    return print_json(json);
  }
  TextTable table(TextTable::Align::kLeft);
  table.row({"format", fmt::format("B-TMS map, revision {}", info.revision)});
  table.row({"digest", info.digest.hex()});
  table.row({"points", fmt::format("{} from {} files, {} dropped", grouped(info.points), info.inputs.size(),
                                   grouped(info.dropped))});
  table.row({"tiles", fmt::format("{} of {} cells, each {} m", grouped(tiles.size()), info.layout.grid.edge_cells, r)});
  table.row({"x", fmt::format("{:.1f} to {:.1f} m, whole tiles", west, east)});
  table.row({"y", fmt::format("{:.1f} to {:.1f} m, whole tiles", south, north)});
  table.row({"crs", crs_title(info.crs_wkt)});
  table.row({"preset", info.preset});
  for (const ParameterInfo& parameter : parameter_table())
    table.row({std::string(parameter.name),
               fmt::format("{} {}", parameter_text(info.parameters, parameter), parameter.unit)});
  table.print();
}

constexpr const char* kFooter =
    "Examples:\n"
    "  btms info tile.las\n"
    "  btms info city.btms --json";

}  // namespace

Command add_info(CLI::App& btms) {
  auto command = std::make_shared<InfoCommand>();
  CLI::App* app = btms.add_subcommand("info", "Say what a point file or a map is");
  app->footer(kFooter);
  app->add_option("PATH", command->path, "A point file, or a map made by `btms build`")->required()->type_name("");
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] {
            if (std::filesystem::is_directory(command->path))
              print_map(command->path, command->common.json);
            else
              print_point_file(command->path, command->common.json);
            return 0;
          }};
}

}  // namespace btms
