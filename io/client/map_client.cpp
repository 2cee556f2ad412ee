#include "io/client/map_client.h"

#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

#include "engine/error.h"
#include "io/client/event_stream_reader.h"
#include "io/client/multipart.h"
#include "io/export/raw_tile.h"
#include "io/store/json_field.h"
#include "io/store/served_tiles.h"

namespace btms {
namespace {

constexpr std::size_t kMostTiles = 20'000;  // the server's own limit of a diff
constexpr std::size_t kMostBundle = 256;
constexpr std::size_t kMostEvent_bytes = std::size_t{8} << 20;
constexpr std::int64_t kMostRevision = std::numeric_limits<std::int64_t>::max();

[[noreturn]] void bad(const std::string& why) { throw Error(ErrorCode::kBadInput, "the server's answer: " + why); }

double number(const Json& value, const char* name) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) bad(std::string("\"") + name + "\" is no number");
  return value.get<double>();
}
double number_or_nan(const Json& value, const char* name) {
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : number(value, name);
}
double number_member(const Json& object, const char* name) { return number(member(object, name), name); }
std::uint64_t count_member(const Json& object, const char* name) {
  return static_cast<std::uint64_t>(integer_member(object, name, 0, kMostRevision));
}
std::uint64_t revision_member(const Json& object) { return count_member(object, "revision"); }

// Words of a fixed set: they end up in programs' conditions.
std::string word(const Json& value, const char* name) {
  if (!value.is_string() || value.get_ref<const std::string&>().size() > 32)
    bad(std::string("\"") + name + "\" is no word");
  return value.get<std::string>();
}

Json json_of(const HttpAnswer& answer) {
  if (answer.status != 200 || !answer.header("content-type").starts_with("application/json")) bad("it is no JSON");
  return parse_json(answer.body);
}

bool is_etag(std::string_view text) {
  constexpr std::string_view kKind = "xxh3:";
  if (text.size() != kKind.size() + 32 || !text.starts_with(kKind)) return false;
  return text.find_first_not_of("0123456789abcdef", kKind.size()) == text.npos;
}
// As a header has it: in quotes.
std::string quoted_etag(const std::string& header) {
  if (header.size() < 2 || header.front() != '"' || header.back() != '"' ||
      !is_etag(std::string_view(header).substr(1, header.size() - 2)))
    bad("a tile's validator is none");
  return header.substr(1, header.size() - 2);
}

TileId tile_id(const Json& value, int level) {
  if (!value.is_string()) bad("a tile's id is none");
  const auto parsed = parse_served_id(value.get_ref<const std::string&>());
  if (!parsed || parsed->first != level) bad("a tile's id is none of the level");
  return parsed->second;
}

std::string names_of(const TileForm& form) {
  std::string names;
  for (const std::string& layer : form.layers) names.append(names.empty() ? "" : ",").append(layer);
  return names;
}

Json places_json(std::span<const Place> places) {
  Json list = Json::array();
  for (const Place& p : places) list.push_back({p.x_m, p.y_m});
  return list;
}

void note_tiles(const Json& event, ClientEvents& out) {
  for (const Json& tile : array_member(event, "tiles")) {
    const Json& id = member(tile, "id");
    const auto parsed = id.is_string() ? parse_served_id(id.get_ref<const std::string&>()) : std::nullopt;
    if (!parsed) bad("a tile's id is none");
    if (out.tiles.size() >= kMostTiles) {  // then a diff is cheaper
      out.reset = true;
      return;
    }
    out.tiles.push_back(*parsed);
  }
}

ClientEvents events_of(const ServerSentEvent& event) {
  ClientEvents out;
  out.reset = event.name == "reset";
  const Json json = parse_json(std::span(reinterpret_cast<const std::uint8_t*>(event.data.data()), event.data.size()));
  if (!out.reset || json.contains("revision")) out.revision = revision_member(json);
  if (!out.reset) note_tiles(json, out);
  return out;
}

ClientHeight height_of(const Json& json) {
  return {word(member(json, "status"), "status"), word(member(json, "state"), "state"),
          number_or_nan(member(json, "z"), "z"), number_or_nan(member(json, "variance"), "variance")};
}

}  // namespace

std::size_t tile_bytes(const TileForm& form) {
  return form.layers.size() * kServedCells * kServedCells * sizeof(float);
}

BoxM tile_bounds_m(const TileForm& form, TileId id) {
  const double edge_m = form.cell_m * kServedCells;
  return {id.tx * edge_m, id.ty * edge_m, (id.tx + 1.0) * edge_m, (id.ty + 1.0) * edge_m};
}

MapClient::MapClient(ClientOptions options, std::string map)
    : http_(std::move(options)), base_("/v1/maps/" + percent_encoded(map)) {}

HttpAnswer MapClient::post_json(const std::string& name, const std::string& json) {
  return http_.post(base_ + "/" + name, std::span(reinterpret_cast<const std::uint8_t*>(json.data()), json.size()),
                    "application/json");
}

MapDescription MapClient::description() {
  const Json json = json_of(http_.get(base_));
  MapDescription out;
  out.id = text_member(json, "id");
  out.digest = text_member(json, "digest");
  out.crs = text_member(json, "crs");
  out.revision = revision_member(json);
  if (const Json& epsg = member(json, "epsg"); !epsg.is_null())
    out.epsg = static_cast<int>(integer(epsg, "epsg", 1, 1'000'000));
  const Json& bounds = array_member(json, "bounds");
  if (bounds.size() != 4) bad("\"bounds\" has no four numbers");
  for (std::size_t i = 0; i < 4; ++i) out.bounds_m[i] = number(bounds[i], "bounds");
  if (out.bounds_m[0] > out.bounds_m[2] || out.bounds_m[1] > out.bounds_m[3]) bad("\"bounds\" is no box");
  for (const Json& level : array_member(json, "levels")) {
    if (out.levels.size() > static_cast<std::size_t>(kMaxLevel)) bad("too many levels");
    const double cell_m = number_member(level, "cell_m");
    if (integer_member(level, "level", 0, kMaxLevel) != static_cast<std::int64_t>(out.levels.size()) ||
        integer_member(level, "tile_cells", 1, 1 << 20) != kServedCells || !(cell_m > 0 && cell_m < 1e9))
      bad("a level is none this client knows");
    out.levels.push_back({cell_m, count_member(level, "tiles")});
  }
  if (out.levels.empty()) bad("it has no levels");
  for (const Json& layer : array_member(json, "layers")) {
    if (out.layers.size() >= 256) bad("too many layers");
    out.layers.push_back(word(member(layer, "name"), "name"));
  }
  const Json& vehicle = member(json, "vehicle");
  out.vehicle_width_m = number_member(vehicle, "width_m");
  out.vehicle_height_m = number_member(vehicle, "height_m");
  out.vehicle_max_slope_deg = number_member(vehicle, "max_slope_deg");
  out.vehicle_max_step_m = number_member(vehicle, "max_step_m");
  return out;
}

ClientTile MapClient::tile_of(const TileForm& form, TileId id, const std::string& etag,
                              std::span<const std::uint8_t> raw) const {
  ClientTile tile{id, etag, tile_bounds_m(form, id), {}};
  if (raw.empty()) return tile;
  const RawHeader header = parse_raw_tile(raw);
  if (header.level != form.level || header.tx != id.tx || header.ty != id.ty || header.layers != form.layers.size() ||
      header.rows != kServedCells || header.cols != kServedCells || header.cell_m != form.cell_m ||
      header.min_x_m != tile.bounds_m[0] || header.min_y_m != tile.bounds_m[1])
    bad("a tile is another than was asked for");
  tile.values.resize((raw.size() - kRawHeader_bytes) / sizeof(float));
  std::memcpy(tile.values.data(), raw.data() + kRawHeader_bytes, tile.values.size() * sizeof(float));
  return tile;
}

std::optional<ClientTile> MapClient::tile(const TileForm& form, TileId id, const std::string& etag) {
  HttpHeaders headers;
  if (!etag.empty()) headers["if-none-match"] = "\"" + etag + "\"";
  const HttpAnswer answer = http_.get(
      base_ + "/tiles/" + served_id(form.level, id) + "?layers=" + percent_encoded(names_of(form)) + "&f=raw", headers);
  const std::string tag = quoted_etag(answer.header("etag"));
  if (answer.status == 304) {
    if (etag.empty() || tag != etag) bad("it says nothing has changed, of another tile");
    return {};
  }
  if ((answer.status == 204) != answer.body.empty()) bad("a tile without bytes");
  return tile_of(form, id, tag, answer.body);
}

TileDiff MapClient::diff(const TileForm& form, Place centre, double radius_m,
                         const std::map<TileId, std::string>& have) {
  Json held = Json::object();
  for (const auto& [id, etag] : have) held[served_id(form.level, id)] = etag;
  const Json question{{"area", {{"center", {centre.x_m, centre.y_m}}, {"radius", radius_m}}},
                      {"level", form.level},
                      {"layers", form.layers},
                      {"f", "raw"},
                      {"have", std::move(held)}};
  const Json json = json_of(post_json("diff", question.dump()));
  TileDiff out;
  out.revision = revision_member(json);
  std::map<TileId, bool> seen;
  const auto note = [&](TileId id) {
    if (seen.size() >= 2 * kMostTiles || !seen.emplace(id, true).second) bad("a tile is named twice, or too many are");
  };
  for (const Json& entry : array_member(json, "add")) {
    const TileId id = tile_id(member(entry, "id"), form.level);
    const std::string etag = text_member(entry, "etag");
    if (!is_etag(etag)) bad("a tile's validator is none");
    note(id);
    out.add.push_back({id, etag});
  }
  for (const Json& entry : array_member(json, "remove")) {
    const TileId id = tile_id(entry, form.level);
    if (!have.contains(id)) bad("it removes a tile that is not there");
    note(id);
    out.remove.push_back(id);
  }
  return out;
}

std::vector<ClientTile> MapClient::bundle(const TileForm& form, std::span<const TileId> ids) {
  if (ids.size() > kMostBundle) throw Error(ErrorCode::kUsage, "a bundle has at most 256 tiles");
  Json list = Json::array();
  for (const TileId id : ids) list.push_back(served_id(form.level, id));
  const Json question{{"ids", std::move(list)}, {"layers", form.layers}, {"f", "raw"}};
  const HttpAnswer answer = post_json("bundle", question.dump());
  const std::vector<Part> parts = parse_multipart(answer.header("content-type"), answer.body, ids.size());
  if (parts.size() != ids.size()) bad("tiles are missing");
  std::vector<ClientTile> tiles;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto location = parts[i].headers.find("content-location"), etag = parts[i].headers.find("etag");
    if (location == parts[i].headers.end() || etag == parts[i].headers.end() ||
        location->second != served_id(form.level, ids[i]))
      bad("a tile is another than was asked for");
    tiles.push_back(tile_of(form, ids[i], quoted_etag(etag->second), parts[i].body));
  }
  return tiles;
}

ClientHeight MapClient::height(Place place, std::optional<double> z_hint_m) {
  const auto text = [](double value) { return percent_encoded(Json(value).dump()); };
  std::string target = base_ + "/height?x=" + text(place.x_m) + "&y=" + text(place.y_m);
  if (z_hint_m) target += "&z=" + text(*z_hint_m);
  return height_of(json_of(http_.get(target)));
}

std::vector<ClientHeight> MapClient::heights(std::span<const Place> places) {
  const Json json = json_of(post_json("height", Json{{"points", places_json(places)}}.dump()));
  const Json& list = array_member(json, "heights");
  if (list.size() != places.size()) bad("another number of heights");
  std::vector<ClientHeight> out;
  for (const Json& height : list) out.push_back(height_of(height));
  return out;
}

std::vector<ClientProfilePoint> MapClient::profile(std::span<const Place> line, double step_m) {
  const Json question{{"line", places_json(line)}, {"resample_distance", step_m}, {"height_precision", 3}};
  const Json json = json_of(post_json("profile", question.dump()));
  std::vector<ClientProfilePoint> out;
  for (const Json& p : array_member(json, "profile")) {
    if (!p.is_array() || p.size() != 3) bad("a point of the profile is none");
    out.push_back({number(p[0], "distance"), number_or_nan(p[1], "z"), word(p[2], "state")});
  }
  return out;
}

ClientCheck MapClient::check_path(std::span<const Place> path, std::optional<double> radius_m) {
  Json question{{"path", places_json(path)}};
  if (radius_m) question["radius"] = *radius_m;
  const Json json = json_of(post_json("check", question.dump()));
  ClientCheck out;
  out.revision = revision_member(json);
  const Json& safe = member(json, "is_safe");
  if (!safe.is_boolean()) bad("\"is_safe\" is neither true nor false");
  out.safe = safe.get<bool>();
  out.traversability = number_member(json, "traversability");
  const Json& first = member(json, "first_bad");
  if (first.is_null() != out.safe) bad("it is safe and it is not");
  if (!out.safe) {
    out.reason = word(member(first, "reason"), "reason");
    out.first_bad = {number_member(first, "x"), number_member(first, "y")};
  }
  return out;
}

ClientRoute MapClient::route(Place from, Place to) {
  const Json question{{"from", {from.x_m, from.y_m}}, {"to", {to.x_m, to.y_m}}};
  const Json json = json_of(post_json("route", question.dump()));
  ClientRoute out;
  out.revision = revision_member(json);
  out.status = word(member(json, "status"), "status");
  for (const Json& p : array_member(json, "points")) {
    if (!p.is_array() || p.size() != 3) bad("a point of the route is none");
    out.points.push_back({{number(p[0], "x"), number(p[1], "y")}, number_or_nan(p[2], "z")});
  }
  if ((out.status == "found") == out.points.empty()) bad("a route without points, or points of none");
  out.length_m = number_or_nan(member(json, "length_m"), "length_m");
  out.weight = number_or_nan(member(json, "weight"), "weight");
  out.settled = count_member(json, "settled");
  return out;
}

ClientEvents MapClient::events(std::uint64_t since) {
  const HttpAnswer answer = http_.get(base_ + "/events?since=" + std::to_string(since));
  if (answer.status == 204) return {};
  const Json json = json_of(answer);
  const Json& reset = member(json, "reset");
  if (!reset.is_boolean()) bad("\"reset\" is neither true nor false");
  ClientEvents out{revision_member(json), reset.get<bool>(), {}};
  for (const Json& event : array_member(json, "events")) note_tiles(event, out);
  return out;
}

void MapClient::listen(std::uint64_t since, const std::function<bool(const ClientEvents&)>& heard) {
  EventStreamReader reader(kMostEvent_bytes);
  http_.stream(base_ + "/events", {{"last-event-id", std::to_string(since)}}, "text/event-stream",
               [&](std::string_view piece) {
                 reader.feed(piece);
                 bool any = false;
                 for (auto event = reader.next(); event; event = reader.next()) {
                   if (event->name != "tiles" && event->name != "reset") continue;
                   any = true;
                   if (!heard(events_of(*event))) return false;
                 }
                 return any || heard({});
               });
}

std::vector<std::string> map_names(const ClientOptions& options) {
  HttpClient http(options);
  const Json json = json_of(http.get("/v1/maps"));
  if (!json.is_array() || json.size() > 10'000) bad("no list of maps");
  std::vector<std::string> names;
  for (const Json& map : json) names.push_back(text_member(map, "id"));
  return names;
}

}  // namespace btms
