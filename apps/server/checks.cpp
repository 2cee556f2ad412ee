// Profiles along lines, whether a vehicle may be somewhere, and the way it takes.
#include <cmath>

#include "apps/server/handlers.h"
#include "engine/query/footprint.h"
#include "engine/query/nearest.h"
#include "engine/query/profile.h"
#include "engine/routing/route.h"

namespace btms {
namespace {

std::vector<Place> places_of(const Json& array, const char* field, std::size_t most) {
  if (!array.is_array()) throw Problem("bad_body", "expected an array of [x, y]", field);
  if (array.size() > most) throw Problem("too_much", "at most " + std::to_string(most) + " places", field);
  std::vector<Place> places;
  for (const Json& p : array) places.push_back(place_member(p, field));
  return places;
}

// Google's encoded polyline: signed differences in 1e-5 (1e-6 of Valhalla's polyline6), x first, then y, of the map's
// frame.
std::vector<Place> decoded_polyline(const std::string& text, std::size_t most) {
  std::vector<Place> places;
  std::int64_t at[2] = {0, 0};
  for (std::size_t i = 0; i < text.size();) {
    for (std::int64_t& coordinate : at) {
      std::uint64_t value = 0;
      for (unsigned shift = 0;; shift += 5) {
        if (i == text.size() || shift > 55) throw Problem("bad_body", "not an encoded polyline", "encoded_polyline");
        const int c = text[i++] - 63;
        if (c < 0 || c > 63) throw Problem("bad_body", "not an encoded polyline", "encoded_polyline");
        value |= static_cast<std::uint64_t>(c & 31) << shift;
        if (c < 32) break;
      }
      coordinate += (value & 1) ? ~static_cast<std::int64_t>(value >> 1) : static_cast<std::int64_t>(value >> 1);
    }
    places.push_back({static_cast<double>(at[0]) / 1e5, static_cast<double>(at[1]) / 1e5});
    if (places.size() > most) throw Problem("too_much", "too many places", "encoded_polyline");
  }
  return places;
}

double member_number(const Json& json, const char* name, double otherwise) {
  const auto it = json.find(name);
  if (it == json.end()) return otherwise;
  if (!it->is_number() || !std::isfinite(it->get<double>())) throw Problem("bad_body", "expected a number", name);
  return it->get<double>();
}

Json rounded(double value, double unit) {
  return std::isfinite(value) ? Json(std::round(value / unit) * unit) : Json();
}

VehicleLimits limits_member(const Json& json, const Parameters& parameters) {
  VehicleLimits limits = limits_of(parameters);
  const auto it = json.find("limits");
  if (it == json.end()) return limits;
  if (!it->is_object()) throw Problem("bad_body", "expected an object", "limits");
  limits.slope_deg = member_number(*it, "slope_deg", limits.slope_deg);
  limits.step_m = member_number(*it, "step_m", limits.step_m);
  limits.roughness_m = member_number(*it, "roughness_m", limits.roughness_m);
  limits.height_m = member_number(*it, "height_m", limits.height_m);
  const Json unknown = it->value("unknown", Json("bad"));
  if (unknown != "ok" && unknown != "bad") throw Problem("bad_body", "", "limits.unknown", {"ok", "bad"});
  limits.unknown_is_safe = unknown == "ok";
  return limits;
}

Json first_bad(const CheckAnswer& answer) {
  if (answer.safe) return Json();
  return {{"x", answer.at.x_m}, {"y", answer.at.y_m}, {"reason", hazard_name(answer.hazard)}};
}

}  // namespace

Response post_profile(const Call& call) {
  const Json json = json_body(call);
  const std::size_t most = call.limits().points;
  std::vector<Place> line;
  if (const auto encoded = json.find("encoded_polyline"); encoded != json.end()) {
    if (!encoded->is_string()) throw Problem("bad_body", "expected a text", "encoded_polyline");
    line = decoded_polyline(encoded->get<std::string>(), most);
  } else {
    line = places_of(array_member_of(json, "line"), "line", most);
  }
  if (line.empty()) throw Problem("bad_body", "expected at least one place", "line");
  const double step_m = member_number(json, "resample_distance", 0);
  const double precision = member_number(json, "height_precision", 3);
  if (!(precision >= 0 && precision <= 6)) throw Problem("bad_body", "expected 0 to 6", "height_precision");
  double length_m = 0;
  for (std::size_t i = 1; i < line.size(); ++i)
    length_m += std::hypot(line[i].x_m - line[i - 1].x_m, line[i].y_m - line[i - 1].y_m);
  if (step_m > 0 && length_m / step_m > static_cast<double>(most))
    throw Problem("too_much", "at most " + std::to_string(most) + " places", "resample_distance");
  const double unit = std::pow(10, -std::round(precision));
  Json list = Json::array();
  for (const ProfilePoint& p : profile(call.revision->terrain, line, step_m)) {
    if (p.height.status == QueryStatus::kDamaged) throw Problem("tile_corrupt", "`btms verify` says which and why");
    list.push_back({rounded(p.distance_m, 1e-3), rounded(p.height.z_m, unit),
                    p.height.status == QueryStatus::kOutside ? "outside" : node_state_name(p.height.state)});
  }
  return json_response({{"revision", call.revision->number()}, {"profile", std::move(list)}});
}

Response post_check(const Call& call) {
  const Json json = json_body(call);
  const Terrain& terrain = call.revision->terrain;
  const VehicleLimits limits = limits_member(json, call.revision->reader->info().parameters);
  Json bad = Json::array();
  CheckAnswer all{true, 1, Hazard::kNone, {}};
  if (json.contains("polygons")) {
    const Json& polygons = array_member_of(json, "polygons");
    if (polygons.size() > 1000) throw Problem("too_much", "at most 1000 polygons", "polygons");
    for (std::size_t i = 0; i < polygons.size(); ++i) {
      const CheckAnswer one = check_polygon(terrain, places_of(polygons[i], "polygons", 1000), limits);
      all.traversability = std::min(all.traversability, one.traversability);
      if (one.safe) continue;
      bad.push_back(i);
      if (all.safe) all = one;
    }
  } else {
    const std::vector<Place> path = places_of(array_member_of(json, "path"), "path", call.limits().points);
    if (json.contains("footprint")) {
      all = check_path(terrain, path, places_of(json["footprint"], "footprint", 1000), limits);
    } else {
      const double width_m = call.revision->reader->info().parameters.vehicle_width_m;
      all = check_path(terrain, path, member_number(json, "radius", width_m / 2), limits);
    }
  }
  return json_response({{"revision", call.revision->number()},
                        {"is_safe", all.safe},
                        {"traversability", all.traversability},
                        {"first_bad", first_bad(all)},
                        {"bad_polygons", std::move(bad)}});
}

Response post_route(const Call& call) {
  const Json json = json_body(call);
  const auto end = [&](const char* name) {
    const auto it = json.find(name);
    if (it == json.end()) throw Problem("bad_body", "expected [x, y]", name);
    return place_member(*it, name);
  };
  const Place from = end("from"), to = end("to");
  RouteRules rules;
  rules.cost_weight = member_number(json, "cost_weight", rules.cost_weight);
  if (!(rules.cost_weight >= 0 && rules.cost_weight <= 1e6))
    throw Problem("bad_body", "expected 0 to 1e6", "cost_weight");
  rules.snap_m = member_number(json, "snap_m", rules.snap_m);
  if (!(rules.snap_m >= 0)) throw Problem("bad_body", "expected 0 or more", "snap_m");
  const Parameters& parameters = call.revision->reader->info().parameters;
  rules.width_m = member_number(json, "width_m", parameters.vehicle_width_m);
  if (!(rules.width_m >= 0 && rules.width_m <= 1000)) throw Problem("bad_body", "expected 0 to 1000", "width_m");
  rules.limits = limits_member(json, parameters);
  rules.most_nodes = call.limits().route_nodes;
  const Route route = find_route(call.revision->graph, from, to, rules);
  Json points = Json::array();
  for (const RoutePoint& p : route.points)
    points.push_back({rounded(p.place.x_m, 1e-3), rounded(p.place.y_m, 1e-3), rounded(p.z_m, 1e-3)});
  return json_response({{"revision", call.revision->number()},
                        {"status", route_status_name(route.status)},
                        {"points", std::move(points)},
                        {"length_m", rounded(route.length_m, 1e-3)},
                        {"weight", rounded(route.weight, 1e-3)},
                        {"steepest_deg", rounded(route.steepest_deg, 1e-2)},
                        {"settled", route.settled}});
}

}  // namespace btms
