// A map on a tile server: its requests as functions, its answers checked before they are believed.
//
// Lengths in metres of the map frame, x east, y north; missing numbers are NaN. docs/client.md is the guide. Errors as
// in http_client.h; an answer that is not what was asked for is Error(kBadInput), a tile whose bytes differ from their
// hash Error(kVerification).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/lattice/tiles.h"
#include "engine/query/place.h"
#include "io/client/http_client.h"

namespace btms {

using BoxM = std::array<double, 4>;  // min x, min y, max x, max y

struct MapDescription {
  std::string id, digest, crs;  // crs: WKT, or empty
  std::uint64_t revision = 0;
  std::optional<int> epsg;
  BoxM bounds_m{};
  struct Level {
    double cell_m = 0;
    std::uint64_t tiles = 0;
  };
  std::vector<Level> levels;  // finest first; tiles of 128 x 128 squares
  std::vector<std::string> layers;
  double vehicle_width_m = 0, vehicle_height_m = 0, vehicle_max_slope_deg = 0, vehicle_max_step_m = 0;
};

// Which tiles: their level, and the layers of their values in this order.
struct TileForm {
  int level = 0;
  double cell_m = 0;  // of the level, as the description has it
  std::vector<std::string> layers = {"elevation"};
};
// What a tile of the form has in bytes of values.
std::size_t tile_bytes(const TileForm& form);
BoxM tile_bounds_m(const TileForm& form, TileId id);

// Immutable.
struct ClientTile {
  TileId id;
  std::string etag;
  BoxM bounds_m{};
  std::vector<float> values;  // layer after layer, rows from north to south; empty: nothing is there
};

struct TileDiff {
  std::uint64_t revision = 0;
  struct Added {
    TileId id;
    std::string etag;
  };
  std::vector<Added> add;  // new and changed
  std::vector<TileId> remove;
};

struct ClientHeight {
  std::string status, state;  // "ok", "unknown" or "outside"; "observed", "predicted", "obstacle", ...
  double z_m = 0, variance_m2 = 0;
};
struct ClientProfilePoint {
  double distance_m = 0, z_m = 0;
  std::string state;
};
struct ClientCheck {
  std::uint64_t revision = 0;
  bool safe = false;
  double traversability = 0;
  std::string reason;  // of the first place that is bad, or empty
  Place first_bad;
};
struct ClientRoute {
  std::uint64_t revision = 0;
  std::string status;  // "found", or why not: "no_start", "no_goal", "blocked", "too_far"
  struct Point {
    Place place;
    double z_m = 0;
  };
  std::vector<Point> points;
  double length_m = 0, weight = 0;
  std::uint64_t settled = 0;
};
struct ClientEvents {
  std::uint64_t revision = 0;                 // 0: nothing has happened, the server is there
  bool reset = false;                         // what has changed is not known: ask for a diff
  std::vector<std::pair<int, TileId>> tiles;  // level and tile that have changed, come or gone
};

// One thread at a time; stop() from any.
class MapClient {
 public:
  // `map`: its name on the server. Connects with the first request.
  MapClient(ClientOptions options, std::string map);

  MapDescription description();
  // Nothing when `etag` is that of the tile still.
  std::optional<ClientTile> tile(const TileForm& form, TileId id, const std::string& etag = {});
  // What to fetch and to forget of the tiles that meet the disc, for one who has these validators.
  TileDiff diff(const TileForm& form, Place centre, double radius_m, const std::map<TileId, std::string>& have);
  // At most 256. In the order of `ids`.
  std::vector<ClientTile> bundle(const TileForm& form, std::span<const TileId> ids);

  ClientHeight height(Place place, std::optional<double> z_hint_m = {});
  std::vector<ClientHeight> heights(std::span<const Place> places);
  std::vector<ClientProfilePoint> profile(std::span<const Place> line, double step_m);
  // A disc along a path, with the limits of the map's vehicle; its width without a radius.
  ClientCheck check_path(std::span<const Place> path, std::optional<double> radius_m = {});
  ClientRoute route(Place from, Place to);

  // What has happened since a revision; its number when nothing has.
  ClientEvents events(std::uint64_t since);
  // The same as a stream: calls `heard` when it has begun, at every event and every comment, until that returns false;
  // returns when the server ends it.
  void listen(std::uint64_t since, const std::function<bool(const ClientEvents&)>& heard);

  void stop() { http_.stop(); }

 private:
  HttpAnswer post_json(const std::string& name, const std::string& json);
  ClientTile tile_of(const TileForm& form, TileId id, const std::string& etag, std::span<const std::uint8_t> raw) const;

  HttpClient http_;
  const std::string base_;  // /v1/maps/{m}
};

// The maps a server has.
std::vector<std::string> map_names(const ClientOptions& options);

}  // namespace btms
