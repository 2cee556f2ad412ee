// Heights as tiles of web maps: Web Mercator, 256 x 256 pixels, terrarium colours. MapLibre GL draws them as terrain.
#include <charconv>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "apps/server/handlers.h"
#include "io/export/terrarium.h"
#include "io/store/projection.h"

namespace btms {
namespace {

constexpr int kPixels = 256, kMostZoom = 24;
constexpr double kHalfWorld_m = 20037508.342789244;  // pi times the radius of Web Mercator's sphere

const Projection& projection_of(const MapRevision& revision) {
  if (!revision.projection)
    throw Problem("no_crs", "the map names no reference system that leads to WGS 84; `btms build --crs EPSG:n` does");
  return *revision.projection;
}

struct WebTile {
  int zoom;
  std::int64_t x, y;
  double pixel_m() const { return 2 * kHalfWorld_m / (std::ldexp(1.0, zoom) * kPixels); }
};

std::int64_t whole(const std::string& text, const char* field) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 0)
    throw Problem("bad_parameter", "expected a whole number", field);
  return value;
}

WebTile web_tile(const Call& call) {
  const std::int64_t zoom = whole(call.arguments[0], "z");
  if (zoom > kMostZoom) throw Problem("unknown_level", "zooms are 0 to 24", "z");
  const WebTile tile{static_cast<int>(zoom), whole(call.arguments[1], "x"), whole(call.arguments[2], "y")};
  if ((tile.x | tile.y) >> zoom != 0) throw Problem("outside", "beyond the world");
  return tile;
}

// Centres of the pixels, from the top.
std::vector<Place> pixels_of(const WebTile& tile, const Projection& projection) {
  std::vector<Place> places;
  places.reserve(kPixels * kPixels);
  for (int row = 0; row < kPixels; ++row)
    for (int col = 0; col < kPixels; ++col)
      places.push_back({(static_cast<double>(tile.x) * kPixels + col + 0.5) * tile.pixel_m() - kHalfWorld_m,
                        kHalfWorld_m - (static_cast<double>(tile.y) * kPixels + row + 0.5) * tile.pixel_m()});
  projection.mercator_to_map(places);
  return places;
}

// Of the surface itself where pixels are no larger than squares, else of the level whose squares are as large.
std::vector<double> heights_of(const MapRevision& revision, const std::vector<Place>& places) {
  std::vector<double> heights(places.size(), std::numeric_limits<double>::quiet_NaN());
  const auto levels = revision.tiles.levels();
  const auto middle = static_cast<std::size_t>(kPixels / 2 * kPixels + kPixels / 2);
  const double pixel_m =
      std::hypot(places[middle + 1].x_m - places[middle].x_m, places[middle + 1].y_m - places[middle].y_m);
  std::size_t level = 0;
  while (level + 1 < levels.size() && levels[level].cell_m < 0.75 * pixel_m) ++level;
  if (level == 0) {
    std::vector<HeightAnswer> answers(places.size());
    revision.terrain.heights(places, answers);
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (answers[i].status == QueryStatus::kDamaged) throw Problem("tile_corrupt", "`btms verify` says which and why");
      heights[i] = answers[i].z_m;
    }
    return heights;
  }
  const double cell_m = levels[level].cell_m;
  const CellBox extent = levels[level].extent;
  const CellBox all{extent.col0 * kServedCells, extent.row0 * kServedCells, extent.col1 * kServedCells,
                    extent.row1 * kServedCells};
  const auto cell_of = [&](Place p) {
    return Cell{static_cast<std::int32_t>(std::floor(p.x_m / cell_m)),
                static_cast<std::int32_t>(std::floor(p.y_m / cell_m))};
  };
  const auto far = [](Place p) { return !(std::abs(p.x_m) < 1e8 && std::abs(p.y_m) < 1e8); };
  CellBox box;
  for (const Place& p : places)
    if (!far(p) && all.contains(cell_of(p)))
      box = box.hull({cell_of(p).col, cell_of(p).row, cell_of(p).col + 1, cell_of(p).row + 1});
  if (box.empty()) return heights;
  const RasterLayer* elevation[] = {find_raster_layer("elevation")};
  const Window window = cut_window(*revision.reader, revision.terrain.tiles(), static_cast<int>(level), box, elevation);
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (far(places[i]) || !box.contains(cell_of(places[i]))) continue;
    const Cell cell = cell_of(places[i]);
    const auto row = static_cast<std::size_t>(box.row1 - 1 - cell.row),
               col = static_cast<std::size_t>(cell.col - box.col0);
    heights[i] = static_cast<double>(window.values[0][row * window.cols + col]);
  }
  return heights;
}

// The address the client used, where it is one: what a TileJSON names has to be whole.
std::string origin_of(const Request& request) {
  const std::string host = request.header("host");
  const bool plain = !host.empty() && host.size() < 256 &&
                     host.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-:[]") ==
                         std::string::npos;
  return plain ? "http://" + host : "";
}

}  // namespace

Response get_web_tile(const Call& call) {
  const WebTile tile = web_tile(call);
  const Projection& projection = projection_of(*call.revision);
  const std::string etag = "xyz:" + call.revision->reader->info().digest.hex() + ":" + std::to_string(tile.zoom) + "/" +
                           std::to_string(tile.x) + "/" + std::to_string(tile.y);
  Response response;
  response.set("ETag", "\"" + etag + "\"");
  response.set("Cache-Control", "no-cache");
  if (call.request.header("if-none-match").find("\"" + etag + "\"") != std::string::npos) {
    response.status = 304;
    return response;
  }
  Body body = call.service.bodies().find(etag);
  if (!body) {
    const std::vector<Place> places = pixels_of(tile, projection);
    body = std::make_shared<const std::vector<std::uint8_t>>(
        terrarium_png(kPixels, kPixels, heights_of(*call.revision, places)));
    call.service.bodies().keep(etag, body);
  }
  if (body->empty()) throw Problem("outside", "the map has no data there");
  response.content_type = "image/png";
  response.body = std::move(body);
  return response;
}

Response get_tilejson(const Call& call) {
  const Projection& projection = projection_of(*call.revision);
  const auto [x0, y0, x1, y1] = call.revision->tiles.bounds_m();
  std::vector<Place> corners = {{x0, y0}, {x1, y0}, {x0, y1}, {x1, y1}};
  projection.map_to_degrees(corners);
  double west = 180, south = 90, east = -180, north = -90;
  for (const Place& c : corners) {
    west = std::min(west, c.x_m);
    east = std::max(east, c.x_m);
    south = std::min(south, c.y_m);
    north = std::max(north, c.y_m);
  }
  const double finest_m = call.revision->terrain.layout().lattice.resolution_m();
  const double pixel0_m = 2 * kHalfWorld_m / kPixels * std::cos((south + north) / 2 * std::numbers::pi / 180);
  const int most = std::clamp(static_cast<int>(std::ceil(std::log2(pixel0_m / finest_m))), 0, kMostZoom);
  return json_response({{"tilejson", "3.0.0"},
                        {"name", call.map_id},
                        {"description", "Heights; where the map has none inside a tile, they are made up for display"},
                        {"tiles", {origin_of(call.request) + "/xyz/" + call.map_id + "/{z}/{x}/{y}.png"}},
                        {"encoding", "terrarium"},
                        {"tileSize", kPixels},
                        {"minzoom", std::max(0, most - 12)},
                        {"maxzoom", most},
                        {"bounds", {west, south, east, north}}});
}

}  // namespace btms
