// btms query: the height of the terrain at places.
#include <spdlog/fmt/fmt.h>

#include <iostream>

#include "apps/btms/command.h"
#include "apps/btms/coordinates.h"
#include "apps/btms/report.h"
#include "apps/btms/tile_cache.h"
#include "engine/model/surface.h"
#include "io/store/map_store.h"

namespace btms {
namespace {

struct QueryCommand {
  CommonOptions common;
  std::string map;
  std::vector<std::string> at;
};

const char* state_name(NodeState state) {
  switch (state) {
    case NodeState::kObserved:
      return "observed";
    case NodeState::kPredicted:
      return "predicted";
    case NodeState::kObstacle:
      return "obstacle";
    case NodeState::kUnknown:
      break;
  }
  return "unknown";
}

Json place_json(Place place, const SurfacePoint& s) {
  Json json{{"x", place.x_m}, {"y", place.y_m}};
  const bool known = s.state != NodeState::kUnknown;
  json["z"] = known ? Json(s.z_m) : Json();
  json["state"] = state_name(s.state);
  if (known) {
    json["sd"] = s.sd_m;
    json["normal"] = {s.normal[0], s.normal[1], s.normal[2]};
    json["support"] = s.support;
    json["weight"] = s.weight;
  }
  json["count"] = s.count;
  return json;
}

std::string place_text(Place place, const SurfacePoint& s) {
  const std::string where = fmt::format("{:.3f} {:.3f}", place.x_m, place.y_m);
  if (s.state == NodeState::kUnknown) return fmt::format("{} nan unknown nan nan nan nan 0", where);
  return fmt::format("{} {:.3f} {} {:.3f} {:.4f} {:.4f} {:.4f} {:.2f}", where, s.z_m, state_name(s.state), s.sd_m,
                     s.normal[0], s.normal[1], s.normal[2], s.support);
}

int run_query(const QueryCommand& command) {
  const auto reader = MapReader::open(command.map);
  const TileCache map(*reader);
  Json places = Json::array();
  if (!command.common.json) print_line("# x_m y_m z_m state sd_m normal_x normal_y normal_z support");
  const auto answer = [&](std::string_view text, const std::string& what) {
    const Place place = parse_place(text, what);
    const SurfacePoint s = surface_at(map, place.x_m, place.y_m);
    if (command.common.json)
      places.push_back(place_json(place, s));
    else
      print_line(place_text(place, s));
  };
  for (const std::string& text : command.at) answer(text, "--at");
  if (command.at.empty()) {
    std::string line;
    for (std::uint64_t n = 1; std::getline(std::cin, line); ++n)
      if (line.find_first_not_of(" \t\r") != std::string::npos) answer(line, fmt::format("line {}", n));
  }
  if (command.common.json) {
    if (command.at.size() == 1)
      print_json(places[0]);
    else
      print_json(Json{{"places", places}});
  }
  return 0;
}

constexpr const char* kFooter =
    "Examples:\n"
    "  btms query city.btms --at 120.5,88.25\n"
    "  btms query city.btms --at=-3,4 --at 10,4 --json\n"
    "  printf '120.5 88.25\\n121 88\\n' | btms query city.btms\n"
    "\n"
    "A state is observed (ground seen there), predicted (inferred from the surroundings), obstacle (ground inferred\n"
    "below something that stands there) or unknown (no surface: z is nan, or null in JSON). sd is the standard\n"
    "deviation of the height, support the sum of kernel values behind a prediction. With --json one --at gives one\n"
    "object, several or stdin give {\"places\": [...]}.";

}  // namespace

Command add_query(CLI::App& btms) {
  auto command = std::make_shared<QueryCommand>();
  CLI::App* app = btms.add_subcommand("query", "Ask a map for heights, by option or in batch on stdin");
  app->footer(kFooter);
  app->add_option("MAP", command->map, "A map made by `btms build`")->required()->type_name("");
  app->add_option("--at", command->at,
                  "A place in metres of the map frame; repeatable (default: lines `X Y` from stdin)")
      ->allow_extra_args(false)
      ->default_str("")
      ->type_name("X,Y");
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_query(*command); }};
}

}  // namespace btms
