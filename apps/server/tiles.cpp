// Single tiles and bundles of them.
#include "apps/server/formats.h"
#include "apps/server/handlers.h"
#include "apps/server/representation.h"
#include "io/export/raster.h"
#include "io/export/raw_tile.h"

namespace btms {
namespace {

// What one tile is asked for.
struct TileRequest {
  int level = 0;
  TileId id;
  std::vector<const RasterLayer*> layers;
  const WindowFormat* format = nullptr;
  std::string etag;
};

TileRequest tile_request(const MapRevision& revision, const std::string& id, const std::string& layers,
                         const std::string& format) {
  const auto parsed = parse_served_id(id);
  if (!parsed) throw Problem("bad_parameter", "expected level/column/row, whole numbers", "tile");
  TileRequest out;
  std::tie(out.level, out.id) = *parsed;
  if (out.level < 0 || static_cast<std::size_t>(out.level) >= revision.tiles.levels().size())
    throw Problem("unknown_level", "the map's description lists them", "level");
  if (!revision.tiles.inside(out.level, out.id)) throw Problem("outside", "the map's description has its bounds");
  out.layers = layers_of(layers);
  out.format = &tile_format(format);
  out.etag = revision.tiles.etag(out.level, out.id, tile_form(names_of(out.layers), out.format->name));
  return out;
}

// The stored bytes of a layer, where a tile of the map is a served tile.
Body stored_tile(const Call& call, const TileRequest& tile) {
  if (tile.level > 0 || tile.layers.size() != 1)
    throw Problem("bad_parameter", "stored bytes are of one layer of level 0", "f");
  const MapLayout& layout = call.revision->terrain.layout();
  const CellBox box = ServedTiles::box_of(tile.id);
  const TileId id = layout.grid.tile_of({box.col0, box.row0});
  std::optional<StoredRaster> raster;
  if (layout.grid.box_of(id) == box) raster = call.revision->reader->stored_raster(id, tile.layers[0]->name);
  if (!raster) throw Problem("bad_parameter", "the map does not store this tile in one piece: ask for f=raw", "f");
  if (raster->bytes.empty()) return body_of({});
  return std::make_shared<const std::vector<std::uint8_t>>(chunk_tile(*raster, tile.id, layout.lattice.resolution_m()));
}

Body made_tile(const Call& call, const TileRequest& tile) {
  if (!tile.format->encode) return stored_tile(call, tile);
  const Window window = cut_window(*call.revision->reader, call.revision->terrain.tiles(), tile.level,
                                   ServedTiles::box_of(tile.id), tile.layers);
  if (window.empty()) return body_of({});
  return std::make_shared<const std::vector<std::uint8_t>>(tile.format->encode(window, tile.id, *call.revision));
}

// Encoded; an empty body of a tile without content.
Body encoded_tile(const Call& call, const TileRequest& tile) {
  if (!call.revision->tiles.find(tile.level, tile.id)) return body_of({});
  if (Body known = call.service.bodies().find(tile.etag)) return known;
  Body body = made_tile(call, tile);
  call.service.bodies().keep(tile.etag, body);
  return body;
}

std::string quoted(const std::string& etag) { return "\"" + etag + "\""; }

Response tile_head(const Call& call, const TileRequest& tile, std::string validator) {
  Response response;
  response.set("ETag", std::move(validator));
  response.set("Cache-Control", "no-cache");
  const ServedTile* known = call.revision->tiles.find(tile.level, tile.id);
  if (known) response.set("X-Tile-Revision", std::to_string(known->revision));
  return response;
}

Response tile_response(const Call& call, const TileRequest& tile, Body body) {
  Response response = tile_head(call, tile, quoted(tile.etag));
  response.status = body->empty() ? 204 : 200;
  if (body->empty()) return response;
  response.content_type = tile.format->type;
  response.body = std::move(body);
  return response;
}

TileRequest tile_request(const Call& call) {
  return tile_request(*call.revision, call.arguments[0] + "/" + call.arguments[1] + "/" + call.arguments[2],
                      parameter(call, "layers", "elevation"), parameter(call, "f", "raw"));
}

}  // namespace

std::optional<Response> get_tile_at_once(const Call& call) {
  const TileRequest tile = tile_request(call);
  if (auto held = held_validator(call.request, quoted(tile.etag))) {
    Response response = tile_head(call, tile, *std::move(held));
    response.status = 304;
    return response;
  }
  if (!call.revision->tiles.find(tile.level, tile.id)) return tile_response(call, tile, body_of({}));
  Body body = call.service.bodies().find(tile.etag);
  if (!body) return {};
  return tile_response(call, tile, std::move(body));
}

Response get_tile(const Call& call) {
  if (auto at_once = get_tile_at_once(call)) return *std::move(at_once);
  const TileRequest tile = tile_request(call);
  return tile_response(call, tile, encoded_tile(call, tile));
}

Response post_bundle(const Call& call) {
  const Json json = json_body(call);
  const Json& ids = array_member_of(json, "ids");
  if (ids.size() > call.limits().bundle)
    throw Problem("too_much", "at most " + std::to_string(call.limits().bundle) + " tiles", "ids");
  const std::string layers = names_of(layers_member(json)), format = text_member(json, "f", "raw");
  constexpr const char* kBoundary = "btms-tile";
  std::vector<std::uint8_t> bytes;
  const auto append = [&](std::string_view text) { bytes.insert(bytes.end(), text.begin(), text.end()); };
  for (const Json& id : ids) {
    if (!id.is_string()) throw Problem("bad_body", "expected level/column/row", "ids");
    const TileRequest tile = tile_request(*call.revision, id.get<std::string>(), layers, format);
    const Body body = encoded_tile(call, tile);
    append(std::string("--") + kBoundary + "\r\nContent-Type: " + tile.format->type +
           "\r\nContent-Location: " + served_id(tile.level, tile.id) + "\r\nETag: \"" + tile.etag +
           "\"\r\nContent-Length: " + std::to_string(body->size()) + "\r\n\r\n");
    bytes.insert(bytes.end(), body->begin(), body->end());
    append("\r\n");
  }
  append(std::string("--") + kBoundary + "--\r\n");
  Response response;
  response.content_type = std::string("multipart/mixed; boundary=") + kBoundary;
  response.body = std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
  return response;
}

}  // namespace btms
