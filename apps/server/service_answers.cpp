// What the service says of itself, and the viewer's files.
#include "apps/server/handlers.h"
#include "apps/server/representation.h"

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

Response get_file(const Call& call) {
  const StaticFiles::File* file = call.service.files().find(call.arguments[0]);
  if (!file) throw Problem("not_found");
  Response response;
  const auto held = held_validator(call.request, file->etag);
  response.set("ETag", held.value_or(file->etag));
  response.set("Cache-Control", "no-cache");
  response.set("Content-Security-Policy",
               "default-src 'self'; img-src 'self' data: blob:; worker-src 'self' blob:; frame-ancestors 'none'");
  response.set("X-Content-Type-Options", "nosniff");
  if (held) {
    response.status = 304;
    return response;
  }
  response.content_type = file->content_type;
  response.body = file->body;
  return response;
}

}  // namespace btms
