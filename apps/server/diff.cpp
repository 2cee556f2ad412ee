// What a client that holds tiles has to fetch and to forget. A function of the manifest alone: no tile is read.
#include <algorithm>
#include <cmath>
#include <set>

#include "apps/server/area.h"
#include "apps/server/handlers.h"
#include "io/export/raster.h"
#include "io/export/raw_tile.h"

namespace btms {
namespace {

constexpr double kMaxRadius_m = 1e6;

Area area_of(const Json& json) {
  const auto it = json.find("area");
  if (it == json.end() || !it->is_object()) throw Problem("bad_body", "expected an object", "area");
  if (it->contains("center")) {
    const auto radius = it->find("radius");
    if (radius == it->end() || !radius->is_number() || !(radius->get<double>() >= 0) ||
        !(radius->get<double>() <= kMaxRadius_m))
      throw Problem("bad_body", "expected metres, at most 1000 km", "area.radius");
    return Area::disc(place_member((*it)["center"], "area.center"), radius->get<double>());
  }
  std::vector<Place> corners;
  if (it->contains("bbox")) {
    const Json& box = array_member_of(*it, "bbox");
    if (box.size() != 4) throw Problem("bad_body", "expected [min x, min y, max x, max y]", "area.bbox");
    const Place low = place_member({box[0], box[1]}, "area.bbox"), high = place_member({box[2], box[3]}, "area.bbox");
    if (low.x_m > high.x_m || low.y_m > high.y_m)
      throw Problem("bad_body", "the minimum lies beyond the maximum", "area.bbox");
    corners = {low, {high.x_m, low.y_m}, high, {low.x_m, high.y_m}};
  } else {
    const Json& polygon = array_member_of(*it, "polygon");
    if (polygon.size() < 3 || polygon.size() > 1000)
      throw Problem("bad_body", "expected 3 to 1000 places", "area.polygon");
    for (const Json& corner : polygon) corners.push_back(place_member(corner, "area.polygon"));
  }
  return Area::polygon(std::move(corners));
}

struct Found {
  TileId id;
  double distance2_m2;
};

}  // namespace

Response post_diff(const Call& call) {
  const Json json = json_body(call);
  const Area area = area_of(json);
  const Json level_value = json.value("level", Json(0));
  const auto levels = call.revision->tiles.levels();
  if (!level_value.is_number_integer() || level_value.get<std::int64_t>() < 0 ||
      level_value.get<std::uint64_t>() >= levels.size())
    throw Problem("unknown_level", "the map's description lists them", "level");
  const int level = level_value.get<int>();
  const std::string names = names_of(layers_member(json)), format = text_member(json, "f", "raw");
  const std::string form = tile_form(names, format);
  static const Json kNone = Json::object();
  const Json& have = json.contains("have") ? json["have"] : kNone;
  if (!have.is_object()) throw Problem("bad_body", "expected an object of ids and validators", "have");
  if (have.size() > call.limits().ids)
    throw Problem("too_much", "at most " + std::to_string(call.limits().ids) + " ids", "have");

  const ServedTiles& tiles = call.revision->tiles;
  const auto& of_level = levels[static_cast<std::size_t>(level)];
  std::vector<Found> found;
  const auto look = [&](TileId id) {
    const auto bounds = tiles.bounds_m(level, id);
    if (area.meets(bounds)) found.push_back({id, area.distance2_m2(bounds)});
  };
  const CellBox around = area.tiles(of_level.cell_m * kServedCells).intersect(of_level.extent);
  if (around.cells() < static_cast<std::int64_t>(of_level.tiles.size())) {
    for (std::int32_t ty = around.row0; ty < around.row1; ++ty)
      for (std::int32_t tx = around.col0; tx < around.col1; ++tx)
        if (tiles.find(level, {tx, ty})) look({tx, ty});
  } else {
    for (const auto& entry : of_level.tiles) look(entry.first);
  }
  if (found.size() > call.limits().ids) throw Problem("too_much", "ask for a smaller area or a coarser level", "area");
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
    return a.distance2_m2 != b.distance2_m2 ? a.distance2_m2 < b.distance2_m2 : a.id < b.id;
  });

  const auto layer_count = static_cast<std::size_t>(std::count(names.begin(), names.end(), ',')) + 1;
  std::set<std::string> there;
  Json add = Json::array(), remove = Json::array();
  std::size_t keep = 0;
  for (const Found& tile : found) {
    const std::string id = served_id(level, tile.id), etag = tiles.etag(level, tile.id, form);
    there.insert(id);
    const auto held = have.find(id);
    if (held != have.end() && held->is_string() && held->get_ref<const std::string&>() == etag) {
      ++keep;
      continue;
    }
    Json entry{{"id", id}, {"etag", etag}, {"bbox", tiles.bounds_m(level, tile.id)}};
    entry["bytes"] =
        format == "raw" ? Json(kRawHeader_bytes + layer_count * kServedCells * kServedCells * sizeof(float)) : Json();
    entry["url"] = "/v1/maps/" + call.map_id + "/tiles/" + id + "?layers=" + names + "&f=" + format;
    add.push_back(std::move(entry));
  }
  for (const auto& [id, etag] : have.items())
    if (!there.contains(id)) remove.push_back(id);
  return json_response(
      {{"revision", call.revision->number()}, {"add", std::move(add)}, {"remove", std::move(remove)}, {"keep", keep}});
}

}  // namespace btms
