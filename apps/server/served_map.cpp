#include "apps/server/served_map.h"

#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

#include "engine/error.h"
#include "io/export/raster.h"
#include "io/crs/crs.h"
#include "io/store/manifest.h"
#include "io/store/map_folder.h"

namespace btms {
namespace {

using Json = nlohmann::json;

std::string facts_of(const std::string& id, const Manifest& manifest, const ServedTiles& tiles) {
  const MapInfo& info = manifest.info;
  const Parameters& p = info.parameters;
  Json json{{"id", id}, {"title", id}, {"revision", info.revision}, {"digest", info.digest.hex()}};
  json["schema_version"] = 1;
  json["preset"] = info.preset;
  json["crs"] = info.crs_wkt;
  const Crs crs = info.crs_wkt.empty() ? Crs{} : describe_crs(info.crs_wkt);
  json["epsg"] = crs.epsg > 0 ? Json(crs.epsg) : Json();
  json["vertical_datum"] = crs.vertical_name.empty() ? Json() : Json(crs.vertical_name);
  json["bounds"] = tiles.bounds_m();
  json["origin"] = {0, 0};
  json["resolution_m"] = info.layout.lattice.resolution_m();
  json["stored_tile_cells"] = info.layout.grid.edge_cells;
  json["points"] = info.points;
  Json levels = Json::array();
  for (std::size_t l = 0; l < tiles.levels().size(); ++l)
    levels.push_back({{"level", l},
                      {"cell_m", tiles.levels()[l].cell_m},
                      {"tile_cells", kServedCells},
                      {"tiles", tiles.levels()[l].tiles.size()}});
  json["levels"] = std::move(levels);
  Json layers = Json::array();
  for (const RasterLayer& layer : raster_layers())
    layers.push_back({{"name", layer.name},
                      {"type", "f32"},
                      {"units", layer.units ? Json(layer.units) : Json()},
                      {"nodata", Json()}});
  json["layers"] = std::move(layers);
  json["vehicle"] = {{"width_m", p.vehicle_width_m},
                     {"height_m", p.vehicle_height_m},
                     {"max_slope_deg", p.vehicle_max_slope_deg},
                     {"max_step_m", p.vehicle_max_step_m}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::shared_ptr<const Projection> projection_of(const std::string& crs_wkt) {
  if (crs_wkt.empty()) return nullptr;
  try {
    return std::make_shared<const Projection>(crs_wkt);
  } catch (const Error&) {
    return nullptr;
  }
}

// Tiles of every level whose content differs, those that are gone among them.
MapEvent changes(const MapRevision& before, const MapRevision& after) {
  MapEvent event{after.number(), "update", {}};
  const std::string form = tile_form("elevation", "raw");
  bool kept = false;
  const auto note = [&](int level, TileId id) {
    event.tiles.push_back({served_id(level, id), after.tiles.etag(level, id, form), after.tiles.bounds_m(level, id)});
  };
  const std::size_t levels = std::max(before.tiles.levels().size(), after.tiles.levels().size());
  for (std::size_t l = 0; l < levels; ++l) {
    const int level = static_cast<int>(l);
    if (l < after.tiles.levels().size())
      for (const auto& [id, tile] : after.tiles.levels()[l].tiles) {
        const ServedTile* old = before.tiles.find(level, id);
        if (old && old->content == tile.content)
          kept = true;
        else
          note(level, id);
      }
    if (l < before.tiles.levels().size())
      for (const auto& entry : before.tiles.levels()[l].tiles)
        if (!after.tiles.find(level, entry.first)) note(level, entry.first);
  }
  if (!kept) event.reason = "rebuild";
  std::sort(event.tiles.begin(), event.tiles.end(),
            [](const ChangedTile& a, const ChangedTile& b) { return a.id < b.id; });
  return event;
}

}  // namespace

std::string map_id(const std::filesystem::path& folder) {
  std::filesystem::path path = folder;
  if (!path.has_filename()) path = path.parent_path();
  std::string id = path.extension() == ".btms" ? path.stem().string() : path.filename().string();
  for (char& c : id)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_') c = '-';
  return id;
}

std::string tile_form(const std::string& layers, const std::string& format) { return layers + " " + format; }

ServedMap::ServedMap(std::string id, std::filesystem::path folder, std::size_t cache_bytes)
    : id_(std::move(id)), folder_(std::move(folder)), cache_bytes_(cache_bytes) {
  seen_ = stamp();  // before it is read: a later one is noticed
  current_ = open();
}

ServedMap::Stamp ServedMap::stamp() const {
  struct stat s {};
  if (::stat((folder_ / kManifest).c_str(), &s) != 0) return {};
  return {s.st_ino, s.st_mtim.tv_sec * 1'000'000'000 + s.st_mtim.tv_nsec, s.st_size};
}

std::shared_ptr<const MapRevision> ServedMap::open() const {
  Manifest manifest = read_manifest(folder_);
  ServedTiles tiles(manifest);
  std::string facts = facts_of(id_, manifest, tiles);
  const std::shared_ptr<const MapReader> reader = MapReader::open(folder_, std::move(manifest));
  const Terrain terrain(reader, {cache_bytes_});
  return std::shared_ptr<const MapRevision>(
      new MapRevision{reader, terrain, TraversalGraph(terrain, reader->info().parameters, cache_bytes_ / 2),
                      std::move(tiles), projection_of(reader->info().crs_wkt), std::move(facts)});
}

std::string ServedMap::refresh() {
  const Stamp now = stamp();
  if (now == seen_) return {};
  seen_ = now;
  try {
    const auto before = current();
    const auto after = open();
    if (after->number() == before->number() && after->reader->info().digest == before->reader->info().digest) return {};
    current_ = after;
    events_.publish(changes(*before, *after));
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

}  // namespace btms
