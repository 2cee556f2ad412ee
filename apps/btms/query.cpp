// btms query: the height of the terrain at places or along a line, and whether a vehicle may go there.
#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <iostream>
#include <optional>

#include "apps/btms/command.h"
#include "apps/btms/coordinates.h"
#include "apps/btms/number_range.h"
#include "apps/btms/open_map.h"
#include "apps/btms/query_line.h"
#include "apps/btms/report.h"
#include "engine/error.h"
#include "engine/query/terrain.h"

namespace btms {
namespace {

struct QueryCommand {
  CommonOptions common;
  std::string map;
  std::vector<std::string> at;
  std::optional<double> profile_step_m;
  std::string check;
  std::optional<double> max_slope_deg, max_step_m, height_m;
  bool unknown_is_safe = false, untrusted = false;
};

// What a place is asked about.
struct Answer {
  Place place;
  Terrain::Detail detail;

  bool known() const { return detail.status == QueryStatus::kOk; }
  const char* state() const {
    return detail.status == QueryStatus::kOutside ? "outside" : node_state_name(detail.surface.state);
  }
};

const char* kind_name(UpperKind kind) { return kind == UpperKind::kReachable ? "reachable" : "detached"; }

Json normal_json(const double (&normal)[3]) { return {tidy(normal[0]), tidy(normal[1]), tidy(normal[2])}; }

Json upper_json(const std::vector<UpperPoint>& upper) {
  Json all = Json::array();
  for (const UpperPoint& u : upper)
    all.push_back({{"z", tidy(u.z_m)},
                   {"kind", kind_name(u.kind)},
                   {"sd", tidy(u.sd_m)},
                   {"normal", normal_json(u.normal)},
                   {"count", u.count}});
  return all;
}

// The same keys everywhere; null where there is no surface, nothing above or no way across.
Json answer_json(const Answer& a) {
  const SurfacePoint& s = a.detail.surface;
  const auto number = [&](double n) { return a.known() && std::isfinite(n) ? Json(tidy(n)) : Json(); };
  Json json{{"x", a.place.x_m}, {"y", a.place.y_m}};
  json["z"] = number(s.z_m);
  json["state"] = a.state();
  json["sd"] = number(s.sd_m);
  json["normal"] = a.known() ? normal_json(s.normal) : Json();
  json["support"] = number(s.support);
  json["weight"] = number(s.weight);
  json["count"] = s.count;
  json["terrain"] = number(s.terrain_m);
  json["roughness"] = number(s.roughness_m);
  json["step"] = number(s.step_m);
  json["clearance"] = number(s.clearance_m);
  json["cost"] = number(s.cost);
  json["source_resolution"] = number(s.source_resolution_m);
  json["upper"] = upper_json(a.detail.upper);
  return json;
}

std::string upper_text(const std::vector<UpperPoint>& upper) {
  std::string text;
  for (const UpperPoint& u : upper)
    text += fmt::format("{}{:.3f}:{}", text.empty() ? "" : ",", u.z_m, kind_name(u.kind));
  return text.empty() ? "-" : text;
}

std::string answer_text(const Answer& a) {
  const SurfacePoint& s = a.detail.surface;
  const std::string where = fmt::format("{:.3f} {:.3f}", a.place.x_m, a.place.y_m);
  const std::string upper = upper_text(a.detail.upper);
  if (!a.known())
    return fmt::format("{} nan {} nan nan nan nan nan nan {} nan nan nan nan nan nan {}", where, a.state(), s.count,
                       upper);
  return fmt::format(
      "{} {:.3f} {} {:.3f} {:.3f} {:.3f} {:.3f} {:.3f} {:.3f} {} {:.3f} {:.3f} {:.3f} {:.3f} {:.3f} {} {}", where,
      s.z_m, a.state(), s.sd_m, s.normal[0], s.normal[1], s.normal[2], s.support, s.weight, s.count, s.terrain_m,
      s.roughness_m, s.step_m, s.clearance_m, s.cost, s.source_resolution_m, upper);
}

// Those of the options, else line by line as they come in.
template <class Fn>
void for_each_place(const std::vector<Place>& at, const Fn& fn) {
  for (const Place& place : at) fn(place);
  if (!at.empty()) return;
  std::string line;
  for (std::uint64_t n = 1; std::getline(std::cin, line); ++n)
    if (line.find_first_not_of(" \t\r") != std::string::npos) fn(parse_place(line, fmt::format("line {}", n)));
}

void print_places(const Terrain& terrain, const std::vector<Place>& at, bool json) {
  Json all = Json::array();
  if (!json)
    print_line(
        "# x_m y_m z_m state sd_m normal_x normal_y normal_z support weight count terrain_m roughness_m step_m "
        "clearance_m cost source_m upper_z_m:kind");
  for_each_place(at, [&](Place place) {
    const Answer a{place, terrain.detail(place)};
    if (json)
      all.push_back(answer_json(a));
    else
      print_line(answer_text(a));
  });
  if (json) print_json(at.size() == 1 ? all[0] : Json{{"places", all}});
}

VehicleLimits limits_for(const QueryCommand& command, const Parameters& parameters) {
  VehicleLimits limits = limits_of(parameters);
  limits.slope_deg = command.max_slope_deg.value_or(limits.slope_deg);
  limits.step_m = command.max_step_m.value_or(limits.step_m);
  limits.height_m = command.height_m.value_or(limits.height_m);
  limits.unknown_is_safe = command.unknown_is_safe;
  return limits;
}

int run_query(const QueryCommand& command) {
  std::vector<Place> at;
  for (const std::string& text : command.at) at.push_back(parse_place(text, "--at"));
  const std::shared_ptr<const MapReader> map = open_map(command.map, command.untrusted);
  const Terrain terrain(map);
  const bool json = command.common.json;
  std::vector<Place> line;
  if (command.profile_step_m || !command.check.empty()) for_each_place(at, [&](Place p) { line.push_back(p); });
  if (command.profile_step_m) {
    print_profile(terrain, line, *command.profile_step_m, json);
  } else if (!command.check.empty()) {
    const Place size = parse_place(command.check, "--check");
    if (!(size.x_m > 0 && size.y_m > 0))
      throw Error(ErrorCode::kUsage, fmt::format("--check: found `{}`, expected lengths above 0", command.check));
    print_check(terrain, line, size.x_m, size.y_m, limits_for(command, map->info().parameters), json);
  } else {
    print_places(terrain, at, json);
  }
  return 0;
}

constexpr const char* kQueryFooter =
    "Examples:\n"
    "  btms query city.btms --at 120.5,88.25\n"
    "  btms query city.btms --at=-3,4 --at 10,4 --json\n"
    "  printf '120.5 88.25\\n121 88\\n' | btms query city.btms\n"
    "  btms query city.btms --at 290,300 --at 276,339 --profile 5      heights along the line, each 5 m\n"
    "  btms query city.btms --at 290,300 --at 276,339 --check 4.2,1.8  may a car go there?\n"
    "\n"
    "A state is observed (ground seen there), predicted (inferred from the surroundings), obstacle (ground inferred\n"
    "below something that stands there), filled (a guess far from any ground seen), unknown (no surface, z is nan, or\n"
    "null in JSON) or outside (nor is the map there; `btms info city.btms` says where it is). sd is the standard\n"
    "deviation of the height, support the sum of kernel values behind a prediction, weight how traversable the node\n"
    "is, count its points; points up to `terrain` above the surface are terrain; roughness is the rms distance of\n"
    "those from it, step the jump in height of the ground, clearance what is free above it (inf, or null, where\n"
    "nothing is above), cost what crossing costs the vehicle of the parameters (0 to 1; inf, or null: not\n"
    "traversable), source the edge of the squares the height comes from, upper the heights of further surfaces there\n"
    "(bridge decks, ceilings), each with its kind: reachable where it joins the terrain somewhere, else detached. With "
    "--json one --at gives one object, several or stdin give {\"places\": [...]}.\n"
    "\n"
    "--check holds every triangle that the vehicle touches against its limits (slope, step, clearance; known and no\n"
    "obstacle) and names the first that breaks one. traversability is 1 less the greatest share of a limit. It drives\n"
    "ahead along the places and turns on the spot about its middle; at a single place it faces east.";

}  // namespace

Command add_query(CLI::App& btms) {
  auto command = std::make_shared<QueryCommand>();
  CLI::App* app = btms.add_subcommand(
      "query", "Ask a map for heights, by option or in batch on stdin, or whether a vehicle may go there");
  app->footer(kQueryFooter);
  app->add_option("MAP", command->map, "A map made by `btms build`")->required()->type_name("");
  app->add_option("--at", command->at,
                  "A place in metres of the map frame; repeatable (default: lines `X Y` from stdin)")
      ->allow_extra_args(false)
      ->default_str("")
      ->type_name("X,Y");
  auto* const profile = app->add_option("--profile", command->profile_step_m,
                                        "Heights along the line through the places, also every STEP metres (0: not)");
  profile->type_name("STEP");
  auto* const check = app->add_option(
      "--check", command->check,
      "Whether a vehicle of that length and width, in metres, may go along the line through the places");
  check->type_name("LENGTH,WIDTH")->default_str("")->excludes(profile);
  app->add_option("--vehicle-max-slope-deg", command->max_slope_deg, "Its limits, where they are not those of the map")
      ->check(number_range(0, 90))
      ->needs(check)
      ->type_name("DEG");
  app->add_option("--vehicle-max-step-m", command->max_step_m)
      ->check(number_range(0, 1e6))
      ->needs(check)
      ->type_name("M");
  app->add_option("--vehicle-height-m", command->height_m)->check(number_range(0, 1e6))->needs(check)->type_name("M");
  app->add_flag("--unknown-is-safe", command->unknown_is_safe, "Let it go where nothing is known")->needs(check);
  add_untrusted_option(*app, command->untrusted);
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_query(*command); }};
}

}  // namespace btms
