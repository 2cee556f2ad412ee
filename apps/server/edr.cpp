// The map as an OGC API - Environmental Data Retrieval (19-086r6) serves it: the same answers, for GIS clients. Only
// the map's own reference system; CoverageJSON.
#include <algorithm>
#include <charconv>
#include <cmath>

#include "apps/server/handlers.h"
#include "engine/query/profile.h"

namespace btms {
namespace {

// "POINT(1 2)", "LINESTRING(1 2,3 4)", "POLYGON((1 2,3 4,5 6,1 2))": the places in it. Further rings are no part of it.
std::vector<Place> wkt_places(const Call& call, std::string_view kind, std::size_t least) {
  const std::string text = parameter(call, "coords", "");
  const auto refuse = [&]() -> Problem {
    return Problem("bad_parameter", "expected " + std::string(kind) + " in well-known text, in metres", "coords");
  };
  std::string_view rest = text;
  const auto skip = [&] {
    while (!rest.empty() && rest.front() == ' ') rest.remove_prefix(1);
  };
  for (const char c : kind) {
    if (rest.empty() || std::toupper(static_cast<unsigned char>(rest.front())) != c) throw refuse();
    rest.remove_prefix(1);
  }
  const int depth = kind == "POLYGON" ? 2 : 1;
  for (int i = 0; i < depth; ++i) {
    skip();
    if (rest.empty() || rest.front() != '(') throw refuse();
    rest.remove_prefix(1);
  }
  std::vector<Place> places;
  const auto number = [&] {
    skip();
    double value = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
    if (error != std::errc() || !std::isfinite(value)) throw refuse();
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    return value;
  };
  for (;;) {
    const double x = number();
    places.push_back({x, number()});
    skip();
    if (rest.empty()) throw refuse();
    const char next = rest.front();
    rest.remove_prefix(1);
    if (next == ')') break;
    if (next != ',' || places.size() >= call.limits().points) throw refuse();
  }
  for (int i = 1; i < depth; ++i) {
    skip();
    if (rest.empty() || rest.front() != ')') throw refuse();
    rest.remove_prefix(1);
  }
  skip();
  if (!rest.empty() || places.size() < least) throw refuse();
  return places;
}

std::vector<const RasterLayer*> asked_layers(const Call& call) {
  const std::string crs = parameter(call, "crs", "");
  const Json own = Json::parse(call.revision->facts)["epsg"];
  const std::string code = own.is_null() ? "" : std::to_string(own.get<int>());
  if (!crs.empty() && (code.empty() || !crs.ends_with(code) || !crs.starts_with(crs[0] == 'E' ? "EPSG:" : "http")))
    throw Problem("bad_parameter", "only the map's own reference system is served", "crs");
  if (const std::string f = parameter(call, "f", "CoverageJSON"); f != "CoverageJSON")
    throw Problem("bad_parameter", "", "f", {"CoverageJSON"});
  return layers_of(parameter(call, "parameter-name", "elevation"));
}

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json parameter_json(const RasterLayer& layer) {
  const std::string name(layer.name);
  Json json{{"type", "Parameter"}, {"description", {{"en", name}}}, {"observedProperty", {{"label", {{"en", name}}}}}};
  if (layer.units) json["unit"] = {{"symbol", layer.units}};
  return json;
}

// `values` of every layer, shaped and with axes as given.
Response coverage(const Call& call, const char* domain, Json axes, const std::vector<const RasterLayer*>& layers,
                  const std::vector<Json>& values, const Json& shape, const Json& names) {
  const Json facts = Json::parse(call.revision->facts);
  Json system{{"type", "ProjectedCRS"}};
  if (!facts["epsg"].is_null())
    system["id"] = "http://www.opengis.net/def/crs/EPSG/0/" + std::to_string(facts["epsg"].get<int>());
  Json parameters = Json::object(), ranges = Json::object();
  for (std::size_t l = 0; l < layers.size(); ++l) {
    const std::string name(layers[l]->name);
    parameters[name] = parameter_json(*layers[l]);
    Json range{{"type", "NdArray"}, {"dataType", "float"}, {"values", values[l]}};
    if (!shape.empty()) {
      range["shape"] = shape;
      range["axisNames"] = names;
    }
    ranges[name] = std::move(range);
  }
  Response response =
      json_response({{"type", "Coverage"},
                     {"domain",
                      {{"type", "Domain"},
                       {"domainType", domain},
                       {"axes", std::move(axes)},
                       {"referencing", {{{"coordinates", {"x", "y"}}, {"system", std::move(system)}}}}}},
                     {"parameters", std::move(parameters)},
                     {"ranges", std::move(ranges)}});
  response.content_type = "application/prs.coverage+json";
  return response;
}

// The layers at places, one by one: heights are those of the surface there, other values those of the square.
std::vector<Json> values_at(const Call& call, std::span<const Place> places,
                            const std::vector<const RasterLayer*>& layers) {
  std::vector<Json> values(layers.size(), Json::array());
  for (const Place& p : places) {
    const Window at =
        sample_window(call.revision->terrain.tiles(), p.x_m - 0.0005, p.y_m - 0.0005, 0.001, 1, 1, layers);
    const HeightAnswer height = call.revision->terrain.height(p);
    if (height.status == QueryStatus::kDamaged) throw Problem("tile_corrupt", "`btms verify` says which and why");
    for (std::size_t l = 0; l < layers.size(); ++l)
      values[l].push_back(layers[l]->name == "elevation" ? number(height.z_m) : number(at.values[l][0]));
  }
  return values;
}

Response grid(const Call& call, const std::array<double, 4>& box, std::span<const Place> polygon) {
  const auto layers = asked_layers(call);
  const double cell_m = call.revision->terrain.layout().lattice.resolution_m();
  const double col0 = std::floor(box[0] / cell_m), row0 = std::floor(box[1] / cell_m);
  const double cols = std::ceil(box[2] / cell_m) - col0, rows = std::ceil(box[3] / cell_m) - row0;
  // Text takes more room than binary windows do.
  if (!(cols * rows * static_cast<double>(layers.size()) <= 250'000))
    throw Problem("too_much", "more than 250000 values: ask for less, or for a submap");
  const Window window = sample_window(call.revision->terrain.tiles(), col0 * cell_m, row0 * cell_m, cell_m,
                                      static_cast<std::size_t>(std::max(rows, 1.0)),
                                      static_cast<std::size_t>(std::max(cols, 1.0)), layers);
  const auto x_of = [&](std::size_t col) { return window.min_x_m + (static_cast<double>(col) + 0.5) * cell_m; };
  const auto y_of = [&](std::size_t row) { return window.max_y_m() - (static_cast<double>(row) + 0.5) * cell_m; };
  const auto inside = [&](Place p) {
    bool in = polygon.empty();
    for (std::size_t i = 0, k = polygon.size() - 1; i < polygon.size(); k = i++) {
      const Place a = polygon[i], b = polygon[k];
      if ((a.y_m > p.y_m) != (b.y_m > p.y_m) && p.x_m < (b.x_m - a.x_m) * (p.y_m - a.y_m) / (b.y_m - a.y_m) + a.x_m)
        in = !in;
    }
    return in;
  };
  std::vector<Json> values(layers.size(), Json::array());
  for (std::size_t row = 0; row < window.rows; ++row)
    for (std::size_t col = 0; col < window.cols; ++col) {
      const bool in = inside({x_of(col), y_of(row)});
      for (std::size_t l = 0; l < layers.size(); ++l)
        values[l].push_back(in ? number(window.values[l][row * window.cols + col]) : Json());
    }
  const Json axes{{"x", {{"start", x_of(0)}, {"stop", x_of(window.cols - 1)}, {"num", window.cols}}},
                  {"y", {{"start", y_of(0)}, {"stop", y_of(window.rows - 1)}, {"num", window.rows}}}};
  return coverage(call, "Grid", axes, layers, values, {window.rows, window.cols}, {"y", "x"});
}

Json collection(const MapRevision& revision, const std::string& id) {
  const Json facts = Json::parse(revision.facts);
  const std::string crs = facts["epsg"].is_null() ? "" : "EPSG:" + std::to_string(facts["epsg"].get<int>());
  Json queries = Json::object(), parameters = Json::object();
  for (const char* name : {"position", "area", "cube", "trajectory"})
    queries[name] = {{"link",
                      {{"href", "/collections/" + id + "/" + name},
                       {"rel", "data"},
                       {"variables", {{"query_type", name}, {"output_formats", {"CoverageJSON"}}}}}}};
  for (const RasterLayer& layer : raster_layers()) parameters[std::string(layer.name)] = parameter_json(layer);
  Json json{{"id", id},
            {"title", facts["title"]},
            {"extent", {{"spatial", {{"bbox", {facts["bounds"]}}, {"crs", crs}}}}},
            {"links", {{{"href", "/collections/" + id}, {"rel", "self"}}}},
            {"data_queries", std::move(queries)},
            {"output_formats", {"CoverageJSON"}},
            {"parameter_names", std::move(parameters)}};
  json["crs"] = crs.empty() ? Json::array() : Json{crs};
  return json;
}

}  // namespace

Response list_collections(const Call& call) {
  Json list = Json::array();
  for (const auto& map : call.service.maps()) list.push_back(collection(*map->current(), map->id()));
  return json_response({{"collections", std::move(list)}, {"links", {{{"href", "/collections"}, {"rel", "self"}}}}});
}

Response describe_collection(const Call& call) { return json_response(collection(*call.revision, call.map_id)); }

Response get_position(const Call& call) {
  const auto layers = asked_layers(call);
  const std::vector<Place> places = wkt_places(call, "POINT", 1);
  if (places.size() != 1) throw Problem("bad_parameter", "expected one place", "coords");
  std::vector<Json> values = values_at(call, places, layers);
  const Json axes{{"x", {{"values", {places[0].x_m}}}}, {"y", {{"values", {places[0].y_m}}}}};
  return coverage(call, "Point", axes, layers, values, Json(), Json());
}

Response get_trajectory(const Call& call) {
  const auto layers = asked_layers(call);
  const std::vector<Place> places = wkt_places(call, "LINESTRING", 2);
  if (places.size() > 10'000) throw Problem("too_much", "at most 10000 places", "coords");
  Json along = Json::array();
  for (const Place& p : places) along.push_back({p.x_m, p.y_m});
  const Json axes{{"composite", {{"dataType", "tuple"}, {"coordinates", {"x", "y"}}, {"values", std::move(along)}}}};
  return coverage(call, "Trajectory", axes, layers, values_at(call, places, layers), {places.size()}, {"composite"});
}

Response get_area(const Call& call) {
  const std::vector<Place> polygon = wkt_places(call, "POLYGON", 4);
  std::array<double, 4> box{polygon[0].x_m, polygon[0].y_m, polygon[0].x_m, polygon[0].y_m};
  for (const Place& p : polygon)
    box = {std::min(box[0], p.x_m), std::min(box[1], p.y_m), std::max(box[2], p.x_m), std::max(box[3], p.y_m)};
  if (polygon.size() > 1000) throw Problem("too_much", "at most 1000 corners", "coords");
  return grid(call, box, polygon);
}

Response get_cube(const Call& call) { return grid(call, box_of(parameter(call, "bbox", ""), "bbox"), {}); }

}  // namespace btms
