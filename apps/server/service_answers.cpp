// What the service says of itself, and the viewer's files.
#include "apps/server/handlers.h"

namespace btms {

Response get_health(const Call&) { return json_response({{"status", "ok"}}); }

Response get_ready(const Call& call) {
  Json maps = Json::object();
  for (const auto& map : call.service.maps()) maps[map->id()] = map->current()->number();
  return json_response({{"status", "ready"}, {"maps", std::move(maps)}});
}

Response get_metrics(const Call& call) {
  std::string text = call.service.metrics().text();
  const BodyCache::Counts bodies = call.service.bodies().counts();
  const auto line = [&](const char* name, const char* type, const std::string& labels, std::uint64_t value) {
    text += std::string("# TYPE ") + name + " " + type + "\n" + name + labels + " " + std::to_string(value) + "\n";
  };
  line("btms_body_cache_hits_total", "counter", "", bodies.hits);
  line("btms_body_cache_misses_total", "counter", "", bodies.misses);
  line("btms_body_cache_bytes", "gauge", "", bodies.bytes);
  for (const auto& map : call.service.maps()) {
    const auto revision = map->current();
    const TileCache::Counts tiles = revision->terrain.tiles().counts();
    const std::string labels = "{map=\"" + map->id() + "\"}";
    line("btms_map_revision", "gauge", labels, revision->number());
    line("btms_tile_loads_total", "counter", labels, tiles.loads);
    line("btms_tile_cache_bytes", "gauge", labels, tiles.bytes);
  }
  Response response;
  response.content_type = "text/plain; version=0.0.4";
  response.body = body_of(text);
  return response;
}

Response get_openapi(const Call&) {
  Json paths = Json::object();
  for (const Endpoint& route : endpoints()) {
    std::string path = route.pattern;
    if (path == "/{*}") continue;
    Json parameters = Json::array();
    const auto name_next = [&](const std::string& from, const char* name) {
      const std::size_t at = path.find(from);
      if (at == path.npos) return;
      path.replace(at, from.size(), std::string("{") + name + "}");
      parameters.push_back({{"name", name}, {"in", "path"}, {"required", true}, {"schema", {{"type", "string"}}}});
    };
    name_next("{m}", "map");
    for (const char* name : {"level", "column", "row"}) name_next("{}", name);
    std::string method = route.method;
    for (char& c : method) c = static_cast<char>(std::tolower(c));
    paths[path][method] = {
        {"summary", route.summary},
        {"parameters", std::move(parameters)},
        {"responses", {{"200", {{"description", "ok"}}}, {"default", {{"description", "problem"}}}}}};
  }
  return json_response({{"openapi", "3.0.3"},
                        {"info", {{"title", "B-TMS Engine tile service"}, {"version", "1"}}},
                        {"paths", std::move(paths)}});
}

Response get_file(const Call& call) {
  const StaticFiles::File* file = call.service.files().find(call.arguments[0]);
  if (!file) throw Problem("not_found");
  Response response;
  response.set("ETag", file->etag);
  response.set("Cache-Control", "no-cache");
  response.set("Content-Security-Policy",
               "default-src 'self'; img-src 'self' data: blob:; worker-src 'self' blob:; frame-ancestors 'none'");
  response.set("X-Content-Type-Options", "nosniff");
  if (call.request.header("if-none-match") == file->etag) {
    response.status = 304;
    return response;
  }
  response.content_type = file->content_type;
  response.body = file->body;
  return response;
}

}  // namespace btms
