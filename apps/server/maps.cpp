// What maps there are, and what they are.
#include "apps/server/handlers.h"
#include "apps/server/representation.h"

namespace btms {

Response list_maps(const Call& call) {
  Json maps = Json::array();
  for (const auto& map : call.service.maps())
    maps.push_back({{"id", map->id()}, {"title", map->id()}, {"revision", map->current()->number()}});
  return json_response(maps);
}

Response describe_map(const Call& call) {
  Response response;
  std::string etag = "\"";
  etag.append(call.revision->reader->info().digest.hex()).append("-");
  etag.append(std::to_string(call.revision->number())).append("\"");
  const auto held = held_validator(call.request, etag);
  response.set("ETag", held.value_or(etag));
  response.set("Cache-Control", "no-cache");
  if (held) {
    response.status = 304;
    return response;
  }
  response.content_type = "application/json";
  response.body = body_of(call.revision->facts);
  return response;
}

Response list_tiles(const Call& call) {
  const double level = number_parameter(call, "level");
  const auto levels = call.revision->tiles.levels();
  if (!(level >= 0 && level < static_cast<double>(levels.size()) && level == static_cast<int>(level)))
    throw Problem("unknown_level", "the map's description lists them", "level");
  const int l = static_cast<int>(level);
  const auto& tiles = levels[static_cast<std::size_t>(l)].tiles;
  if (tiles.size() > call.limits().ids) throw Problem("too_much", "the level has too many tiles: ask for a diff");
  const std::string form =
      tile_form(names_of(layers_of(parameter(call, "layers", "elevation"))), parameter(call, "f", "raw"));
  Json list = Json::array();
  for (const auto& [id, tile] : tiles)
    list.push_back({{"id", served_id(l, id)},
                    {"etag", call.revision->tiles.etag(l, id, form)},
                    {"bbox", call.revision->tiles.bounds_m(l, id)}});
  return json_response({{"revision", call.revision->number()}, {"tiles", std::move(list)}});
}

}  // namespace btms
