// Heights of places.
#include <cmath>
#include <cstring>

#include "apps/server/handlers.h"
#include "io/export/raster.h"

namespace btms {
namespace {

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json height_json(Place place, const HeightAnswer& a) {
  const bool known = a.status == QueryStatus::kOk;
  Json json{{"x", place.x_m}, {"y", place.y_m}, {"status", query_status_name(a.status)}};
  json["z"] = number(a.z_m);
  json["variance"] = number(a.variance_m2);
  json["sd"] = number(std::sqrt(a.variance_m2));
  json["normal"] = known ? Json(a.normal) : Json();
  json["class"] = static_cast<int>(a.state);
  json["state"] = a.status == QueryStatus::kOutside ? "outside" : node_state_name(a.state);
  json["cost"] = known ? number(a.cost) : Json();
  json["surface"] = known ? Json(a.surface) : Json();
  json["surfaces"] = a.surfaces;
  return json;
}

void refuse_damaged(const HeightAnswer& a) {
  if (a.status == QueryStatus::kDamaged) throw Problem("tile_corrupt", "`btms verify` says which and why");
}

// The values of layers of the square that holds the place.
Json layers_json(const MapRevision& revision, Place place, const std::vector<const RasterLayer*>& layers) {
  const Lattice lattice = revision.terrain.layout().lattice;
  const auto mm = [](double m) { return static_cast<std::int64_t>(std::floor(m * 1000 + 0.5)); };
  const Cell cell = lattice.cell_at(mm(place.x_m), mm(place.y_m));
  const Window window =
      cut_window(revision.terrain.tiles(), 0, {cell.col, cell.row, cell.col + 1, cell.row + 1}, layers);
  Json json = Json::object();
  for (std::size_t l = 0; l < layers.size(); ++l) json[std::string(layers[l]->name)] = number(window.values[l][0]);
  return json;
}

}  // namespace

Response get_height(const Call& call) {
  const Place place{number_parameter(call, "x"), number_parameter(call, "y")};
  const HeightAnswer a = call.revision->terrain.height(place, optional_number(call, "z").value_or(kNoHint));
  refuse_damaged(a);
  if (a.status == QueryStatus::kOutside) throw Problem("outside", "the map's description has its bounds");
  Json json = height_json(place, a);
  if (const std::string names = parameter(call, "layers", ""); !names.empty())
    json["layers"] = layers_json(*call.revision, place, layers_of(names));
  return json_response(json);
}

Response post_heights(const Call& call) {
  std::vector<Place> places;
  std::vector<double> hints;
  const bool binary = call.request.header("content-type") == "application/octet-stream";
  if (binary) {
    const std::string columns = parameter(call, "columns", "2");
    if (columns != "2" && columns != "3") throw Problem("bad_parameter", "", "columns", {"2", "3"});
    const std::size_t width = columns == "3" ? 3 : 2, row_bytes = width * sizeof(double);
    const std::string& body = call.request.body;
    if (body.size() % row_bytes != 0)
      throw Problem("bad_body", "expected float64 x, y (and z of columns=3), little-endian");
    if (body.size() / row_bytes > call.limits().points) throw Problem("too_much", "too many places");
    for (std::size_t at = 0; at < body.size(); at += row_bytes) {
      double row[3] = {0, 0, kNoHint};
      std::memcpy(row, body.data() + at, row_bytes);
      places.push_back({row[0], row[1]});
      hints.push_back(row[2]);
    }
  } else {
    const Json json = json_body(call);
    const Json& points = array_member_of(json, "points");
    if (points.size() > call.limits().points)
      throw Problem("too_much", "at most " + std::to_string(call.limits().points) + " places", "points");
    for (const Json& p : points) {
      places.push_back(place_member(p, "points"));
      hints.push_back(p.size() > 2 && p[2].is_number() ? p[2].get<double>() : kNoHint);
    }
  }
  std::vector<HeightAnswer> answers(places.size());
  call.revision->terrain.heights(places, hints, answers);
  for (const HeightAnswer& a : answers) refuse_damaged(a);
  if (binary) {
    std::vector<std::uint8_t> bytes(answers.size() * 3 * sizeof(double));
    for (std::size_t i = 0; i < answers.size(); ++i) {
      const double row[] = {answers[i].z_m, answers[i].variance_m2, static_cast<double>(answers[i].state)};
      std::memcpy(bytes.data() + i * sizeof row, row, sizeof row);
    }
    Response response;
    response.content_type = "application/octet-stream";
    response.body = std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
    return response;
  }
  Json heights = Json::array();
  for (std::size_t i = 0; i < answers.size(); ++i) heights.push_back(height_json(places[i], answers[i]));
  return json_response({{"revision", call.revision->number()}, {"heights", std::move(heights)}});
}

}  // namespace btms
