// btms route: the way a vehicle takes from one place of a map to another.
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <optional>

#include "apps/btms/command.h"
#include "apps/btms/coordinates.h"
#include "apps/btms/number_range.h"
#include "apps/btms/open_map.h"
#include "apps/btms/outputs.h"
#include "apps/btms/report.h"
#include "engine/error.h"
#include "engine/routing/route.h"
#include "io/crs/crs.h"
#include "io/export/route_picture.h"
#include "io/files/atomic_file.h"

namespace btms {
namespace {

struct RouteCommand {
  CommonOptions common;
  std::string map, from, to, output, picture, layer = "cost";
  RouteRules rules;
  std::optional<double> width_m;
  bool force = false, untrusted = false;
};

std::string ending_of(RouteStatus status, const RouteCommand& command) {
  switch (status) {
    case RouteStatus::kNoStart:
      return fmt::format("nothing traversable within {:g} m of --from {}", command.rules.snap_m, command.from);
    case RouteStatus::kNoGoal:
      return fmt::format("nothing traversable within {:g} m of --to {}", command.rules.snap_m, command.to);
    case RouteStatus::kTooFar:
      return "no way found within the search's limits; ask for a nearer place";
    default:
      return "no way leads from --from to --to";
  }
}

Json points_json(const Route& route) {
  Json points = Json::array();
  for (const RoutePoint& p : route.points) points.push_back({tidy(p.place.x_m), tidy(p.place.y_m), tidy(p.z_m)});
  return points;
}

Json facts_json(const Route& route) {
  return {{"length_m", tidy(route.length_m)},
          {"weight", tidy(route.weight)},
          {"steepest_deg", tidy(route.steepest_deg)},
          {"settled", route.settled}};
}

// Coordinates are those of the map; programs that read GeoJSON as degrees (RFC 7946) are told by "crs" where it is
// known.
std::string geojson(const Route& route, const MapInfo& info) {
  Json feature{{"type", "Feature"},
               {"properties", facts_json(route)},
               {"geometry", {{"type", "LineString"}, {"coordinates", points_json(route)}}}};
  Json all{{"type", "FeatureCollection"}};
  const int epsg = info.crs_wkt.empty() ? 0 : describe_crs(info.crs_wkt).epsg;
  if (epsg != 0)
    all["crs"] = {{"type", "name"}, {"properties", {{"name", fmt::format("urn:ogc:def:crs:EPSG::{}", epsg)}}}};
  all["features"] = Json::array({std::move(feature)});
  return all.dump(1) + "\n";
}

void draw(const RouteCommand& command, const TileSource& map, const Route& route, Place from, Place to) {
  std::vector<Place> way;
  for (const RoutePoint& p : route.points) way.push_back(p.place);
  std::vector<Place> all = way;
  all.push_back(from);
  all.push_back(to);
  Relief relief =
      draw_relief(map, surroundings(all, map.layout().lattice), kReliefPixels, picture_layer(command.layer));
  if (!way.empty()) draw_way(relief, way, kRouteColour);
  draw_mark(relief, from, kStartColour, "from");
  draw_mark(relief, to, kGoalColour, "to");
  relief.picture.write_png(command.picture);
}

void print_route(const Route& route) {
  print_line(fmt::format("# {:.1f} m, at most {:.1f} deg steep, weight {:.1f}; {} nodes looked at", route.length_m,
                         route.steepest_deg, route.weight, route.settled));
  print_line("# x_m y_m z_m");
  for (const RoutePoint& p : route.points)
    print_line(fmt::format("{:.3f} {:.3f} {:.3f}", p.place.x_m, p.place.y_m, p.z_m));
}

int run_route(const RouteCommand& command) {
  const Place from = parse_place(command.from, "--from"), to = parse_place(command.to, "--to");
  std::vector<std::filesystem::path> outputs;
  if (!command.output.empty()) outputs.emplace_back(command.output);
  if (!command.picture.empty()) {
    check_picture(command.picture, command.map, {});
    outputs.emplace_back(command.picture);
  }
  refuse_existing(outputs, command.force);
  const std::shared_ptr<const MapReader> map = open_map(command.map, command.untrusted);
  const Parameters& parameters = map->info().parameters;
  RouteRules rules = command.rules;
  rules.width_m = command.width_m.value_or(parameters.vehicle_width_m);
  rules.limits = limits_of(parameters);
  const Route route = find_route(TraversalGraph(Terrain(map), parameters), from, to, rules);
  const bool found = route.status == RouteStatus::kFound;
  if (found && !command.output.empty()) write_file(command.output, geojson(route, map->info()));
  if (!command.picture.empty()) draw(command, *map, route, from, to);
  if (command.common.json) {
    Json json{{"status", route_status_name(route.status)}, {"points", points_json(route)}};
    json.update(facts_json(route));
    print_json(json);
  } else if (found) {
    print_route(route);
  }
  if (!found) spdlog::error("{}", ending_of(route.status, command));
  return found ? 0 : exit_status(ErrorCode::kFailed);
}

constexpr const char* kRouteFooter =
    "Examples:\n"
    "  btms route city.btms --from 20,30 --to 380,260 --picture route.png\n"
    "  btms route city.btms --from 20,30 --to 380,260 -o route.geojson --cost-weight 0    the shortest way\n"
    "\n"
    "The way leads over triangles that the vehicle of the map's parameters can cross (`btms info` lists them), from "
    "one\n"
    "to the next where the surface is locally convex; what crossing costs, 0 to 1, makes a metre longer. A disc as "
    "wide\n"
    "as the vehicle can go along all of it. Coordinates are metres of the map frame. Exit status 1 when there is no "
    "way; --json then says why: no_start, no_goal, "
    "blocked\n"
    "or too_far.";

}  // namespace

Command add_route(CLI::App& btms) {
  auto command = std::make_shared<RouteCommand>();
  CLI::App* app =
      btms.add_subcommand("route", "Find the cheapest way between two places, over what a vehicle can cross");
  app->footer(kRouteFooter);
  app->add_option("MAP", command->map, "A map made by `btms build`")->required()->type_name("");
  app->add_option("--from", command->from, "Where it begins, in metres of the map frame")->required()->type_name("X,Y");
  app->add_option("--to", command->to, "Where it ends")->required()->type_name("X,Y");
  app->add_option("-o,--output", command->output, "Also write it as GeoJSON")->type_name("FILE");
  app->add_option("--picture", command->picture, "Also draw it on a shaded relief")->type_name("PNG");
  app->add_option("--layer", command->layer,
                  "What colours the picture: state, cost, slope, step, roughness or clearance")
      ->needs("--picture")
      ->capture_default_str()
      ->type_name("NAME");
  app->add_option("--cost-weight", command->rules.cost_weight,
                  "How much longer a metre counts where it costs the most; 0: the shortest way")
      ->check(number_range(0, 1e6))
      ->capture_default_str()
      ->type_name("N");
  app->add_option(
         "--vehicle-width-m", command->width_m,
         "What is left free along the way, where it is not the width in the map's parameters; 0: the line alone")
      ->check(number_range(0, 1000))
      ->type_name("M");
  app->add_option("--snap", command->rules.snap_m, "How far the nearest way may be from either place")
      ->check(number_range(0, 1e6))
      ->capture_default_str()
      ->type_name("M");
  add_force_option(*app, command->force);
  add_untrusted_option(*app, command->untrusted);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_route(*command); }};
}

}  // namespace btms
