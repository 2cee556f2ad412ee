#include "apps/server/service.h"

#include <algorithm>
#include <cstring>

#include "apps/server/handlers.h"
#include "apps/server/problem.h"
#include "apps/server/representation.h"
#include "engine/error.h"

namespace btms {
namespace {

constexpr const char *kJson = "application/json", *kAny = "application/octet-stream";
constexpr const char* kTileTypes = "application/octet-stream application/x-npy image/png image/tiff application/json";
constexpr const char* kWindowTypes =
    "application/octet-stream application/x-npy application/zip image/png image/tiff application/json";

constexpr Parameter kLayers{"layers", "string", "names of layers, separated by commas; elevation when not given"};
constexpr Parameter kTileForm{"f", "raw|npy|png|tif|json|chunk", "form; raw when not given"};
constexpr Parameter kRes{"res", "number", "edge of a square in metres; the map's when not given"};
constexpr Parameter kBox{"bbox", "string", "min x,min y,max x,max y in metres", true};
constexpr Parameter kX{"x", "number", "metres of the map frame", true}, kY{"y", "number", "metres", true};

constexpr Parameter kListParameters[] = {{"level", "integer", "0 is the finest", true}, kLayers, kTileForm};
constexpr Parameter kTileParameters[] = {kLayers, kTileForm};
constexpr Parameter kHeightParameters[] = {
    kX, kY, {"z", "number", "of several surfaces that nearest to it"}, {"layers", "string", "values of layers, too"}};
constexpr Parameter kHeightsParameters[] = {{"columns", "2|3", "of a body of float64: x, y, or x, y and a hint z"}};
constexpr Parameter kSubmapParameters[] = {{"cx", "number", "middle", true},
                                           {"cy", "number", "middle", true},
                                           {"lx", "number", "width in metres", true},
                                           {"ly", "number", "height in metres", true},
                                           kRes,
                                           kLayers,
                                           {"f", "raw|npy|npz|png|tif|json|gridmap-json", "form; npz when not given"}};
constexpr Parameter kCostmapParameters[] = {kBox,
                                            kRes,
                                            {"inflation", "number", "metres around what is occupied"},
                                            {"mode", "trinary|raw", "trinary when not given"},
                                            {"f", "pgm|png", "form; pgm when not given"}};
constexpr Parameter kEventParameters[] = {{"since", "integer", "answers at once with what has changed since then"},
                                          {"bbox", "string", "only tiles that meet it"}};

constexpr Parameter kCoords{"coords", "string", "well-known text, in metres of the map", true};
constexpr Parameter kNames{"parameter-name", "string", "names of layers; elevation when not given"};
constexpr Parameter kCoverage{"f", "string", "CoverageJSON"}, kCrs{"crs", "string", "the map's own"};
constexpr Parameter kCoordsParameters[] = {kCoords, kNames, kCrs, kCoverage};
constexpr Parameter kCubeParameters[] = {kBox, kNames, kCrs, kCoverage};
constexpr const char* kCoverageType = "application/prs.coverage+json";

constexpr const char* kDiffBody =
    R"({"area": {"center": [200, 150], "radius": 300}, "level": 0, "layers": ["elevation"], "f": "raw", "have": {}})";
constexpr const char* kBundleBody = R"({"ids": ["0/0/0"], "layers": ["elevation"], "f": "raw"})";
constexpr const char* kHeightsBody = R"({"points": [[200, 150], [201, 150]]})";
constexpr const char* kProfileBody = R"({"line": [[200, 150], [240, 160]], "resample_distance": 5})";
constexpr const char* kCheckBody =
    R"({"path": [[200, 150], [240, 160]], "footprint": [[-1, -0.9], [3.2, -0.9], [3.2, 0.9], [-1, 0.9]],
"limits": {"slope_deg": 15, "step_m": 0.2, "unknown": "bad"}})";
constexpr const char* kRouteBody = R"({"from": [215, 95], "to": [250, 110], "cost_weight": 4, "width_m": 1.8})";

constexpr Endpoint kEndpoints[] = {
    {"GET", "/healthz", "Whether the server is alive", kJson, {}, nullptr, get_health, nullptr},
    {"GET", "/readyz", "Whether every map is open", kJson, {}, nullptr, get_ready, nullptr},
    {"GET", "/metrics", "Counts, in Prometheus' text form", "text/plain", {}, nullptr, get_metrics, nullptr},
    {"GET", "/openapi.json", "This description", kJson, {}, nullptr, get_openapi, nullptr},
    {"GET", "/v1/maps", "The maps that are served", kJson, {}, nullptr, list_maps, nullptr},
    {"GET", "/v1/maps/{m}", "What a map is: extent, levels, layers", kJson, {}, nullptr, describe_map, nullptr},
    {"GET", "/v1/maps/{m}/tiles", "The tiles of a level, with validators", kJson, kListParameters, nullptr, list_tiles,
     nullptr},
    {"GET", "/v1/maps/{m}/tiles/{}/{}/{}", "One tile: level, column, row", kTileTypes, kTileParameters, nullptr,
     get_tile, get_tile_at_once},
    {"POST",
     "/v1/maps/{m}/diff",
     "What a client that holds tiles has to fetch and to forget",
     kJson,
     {},
     kDiffBody,
     post_diff,
     nullptr},
    {"POST",
     "/v1/maps/{m}/bundle",
     "Many tiles in one answer",
     "multipart/mixed",
     {},
     kBundleBody,
     post_bundle,
     nullptr},
    {"GET", "/v1/maps/{m}/height", "Height, normal, variance and state of a place", kJson, kHeightParameters, nullptr,
     get_height, nullptr},
    {"POST", "/v1/maps/{m}/height", "The same of many places", "application/json application/octet-stream",
     kHeightsParameters, kHeightsBody, post_heights, nullptr},
    {"GET", "/v1/maps/{m}/submap", "A window around a place", kWindowTypes, kSubmapParameters, nullptr, get_submap,
     nullptr},
    {"GET", "/v1/maps/{m}/costmap", "A window as Nav2's map server has it", "image/x-portable-graymap image/png",
     kCostmapParameters, nullptr, get_costmap, nullptr},
    {"GET", "/v1/maps/{m}/costmap.yaml", "The text beside it", "application/yaml", kCostmapParameters, nullptr,
     get_costmap_yaml, nullptr},
    {"POST", "/v1/maps/{m}/profile", "Heights along a line", kJson, {}, kProfileBody, post_profile, nullptr},
    {"POST",
     "/v1/maps/{m}/check",
     "Whether a vehicle may be at places or along a path",
     kJson,
     {},
     kCheckBody,
     post_check,
     nullptr},
    {"POST",
     "/v1/maps/{m}/route",
     "The way a vehicle takes from one place to another",
     kJson,
     {},
     kRouteBody,
     post_route,
     nullptr},
    {"GET", "/v1/maps/{m}/events", "What changes: server-sent events, or since=revision", "text/event-stream",
     kEventParameters, nullptr, get_events, nullptr},
    {"GET", "/collections", "The maps, for OGC API EDR clients", kJson, {}, nullptr, list_collections, nullptr},
    {"GET", "/collections/{m}", "A map", kJson, {}, nullptr, describe_collection, nullptr},
    {"GET", "/collections/{m}/position", "Layers at a POINT", kCoverageType, kCoordsParameters, nullptr, get_position,
     nullptr},
    {"GET", "/collections/{m}/trajectory", "Layers at the places of a LINESTRING", kCoverageType, kCoordsParameters,
     nullptr, get_trajectory, nullptr},
    {"GET", "/collections/{m}/area", "Layers of the squares in a POLYGON", kCoverageType, kCoordsParameters, nullptr,
     get_area, nullptr},
    {"GET", "/collections/{m}/cube", "Layers of the squares in a box", kCoverageType, kCubeParameters, nullptr,
     get_cube, nullptr},
    {"GET", "/xyz/{m}.json", "TileJSON of the tiles for web maps", kJson, {}, nullptr, get_tilejson, nullptr},
    {"GET",
     "/xyz/{m}/{}/{}/{}.png",
     "Heights in terrarium colours: zoom, x, y",
     "image/png",
     {},
     nullptr,
     get_web_tile,
     nullptr},
    {"GET", "/{*}", "The viewer", kAny, {}, nullptr, get_file, nullptr},
};

std::vector<std::string> split(const char* pattern) {
  std::vector<std::string> out;
  for (const char* at = pattern + 1; *at != 0;) {
    const char* end = std::strchr(at, '/');
    if (!end) end = at + std::strlen(at);
    out.emplace_back(at, end);
    at = *end ? end + 1 : end;
  }
  return out;
}

struct Matcher {
  const Endpoint* route;
  std::vector<std::string> segments;

  bool fits(const std::vector<std::string>& path, Call& call) const {
    const bool rest = !segments.empty() && segments.back() == "{*}";
    if (rest ? path.size() < segments.size() - 1 : path.size() != segments.size()) return false;
    call.arguments.clear();
    for (std::size_t i = 0; i < segments.size(); ++i) {
      if (segments[i] == "{*}") {
        call.arguments.emplace_back();
        for (std::size_t k = i; k < path.size(); ++k) call.arguments.back().append(k > i ? "/" : "").append(path[k]);
      } else if (const std::size_t brace = segments[i].find('}'); brace != std::string::npos) {
        const std::string ending = segments[i].substr(brace + 1);  // as in {}.png
        if (!path[i].ends_with(ending)) return false;
        std::string value = path[i].substr(0, path[i].size() - ending.size());
        if (segments[i].starts_with("{m}"))
          call.map_id = std::move(value);
        else
          call.arguments.push_back(std::move(value));
      } else if (segments[i] != path[i]) {
        return false;
      }
    }
    return true;
  }
};

const std::vector<Matcher>& matchers() {
  static const std::vector<Matcher> all = [] {
    std::vector<Matcher> out;
    for (const Endpoint& route : kEndpoints) out.push_back({&route, split(route.pattern)});
    return out;
  }();
  return all;
}

// In a time that does not tell how much of it is right.
bool same_secret(const std::string& a, const std::string& b) {
  unsigned different = a.size() != b.size();
  for (std::size_t i = 0; i < a.size(); ++i)
    different |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b.empty() ? 0 : b[i % b.size()]);
  return different == 0;
}

Response response_of(const Error& error) {
  switch (error.code()) {
    case ErrorCode::kUsage:
      return Problem("bad_parameter", error.what()).response();
    case ErrorCode::kVerification:
      return Problem("tile_corrupt", error.what()).response();
    default:
      return Problem("failed", error.what()).response();
  }
}

}  // namespace

std::span<const Endpoint> endpoints() { return kEndpoints; }

const ServerLimits& Call::limits() const { return service.options().limits; }

Service::Service(ServiceOptions options)
    : options_(std::move(options)), files_(options_.viewer), bodies_(options_.cache_bytes / 2) {
  for (const auto& folder : options_.maps) {
    std::string id = map_id(folder);
    for (const auto& other : maps_)
      if (other->id() == id)
        throw Error(ErrorCode::kUsage, "two maps would have the name '" + id + "'", folder.string());
    maps_.push_back(
        std::make_unique<ServedMap>(std::move(id), folder, options_.cache_bytes / 2 / options_.maps.size()));
  }
}

std::vector<std::string> Service::refresh() {
  std::vector<std::string> wrong;
  for (const auto& map : maps_)
    if (const std::string what = map->refresh(); !what.empty()) wrong.push_back(map->id() + ": " + what);
  return wrong;
}

Response Service::answer(const Request& request) const { return *dispatch(request, false); }
std::optional<Response> Service::answer_at_once(const Request& request) const { return dispatch(request, true); }

std::optional<Response> Service::dispatch(const Request& request, bool at_once) const {
  const auto began = std::chrono::steady_clock::now();
  Call call{request, *this, {}, {}, nullptr, nullptr};
  const Endpoint* route = nullptr;
  std::optional<Response> response;
  try {
    const std::string method = request.method == "HEAD" ? "GET" : request.method;
    std::vector<std::string> allowed;
    for (const Matcher& matcher : matchers()) {
      if (route || (!allowed.empty() && matcher.segments.back() == "{*}") || !matcher.fits(request.path, call))
        continue;
      if (method == matcher.route->method)
        route = matcher.route;
      else
        allowed.push_back(matcher.route->method);
    }
    if (!route && !allowed.empty()) {
      if (std::find(allowed.begin(), allowed.end(), "GET") != allowed.end()) allowed.push_back("HEAD");
      throw Problem("method", "", "", allowed);
    }
    if (!route) throw Problem("not_found");
    // The arguments are those of the last pattern tried.
    for (const Matcher& matcher : matchers())
      if (matcher.route == route) matcher.fits(request.path, call);
    if (at_once && !route->at_once) return {};
    if (!options_.token.empty() && request.path != std::vector<std::string>{"healthz"} &&
        !same_secret(request.header("authorization"), "Bearer " + options_.token))
      throw Problem("token", "send the header Authorization: Bearer TOKEN");
    if (std::strstr(route->pattern, "{m}")) {
      for (const auto& map : maps_)
        if (map->id() == call.map_id) call.map = map.get();
      if (!call.map) throw Problem("unknown_map", "GET /v1/maps lists them");
      call.revision = call.map->current();
    }
    response = at_once ? route->at_once(call) : route->handle(call);
    if (!response || !represent(request, route->pattern + (" " + call.map_id), bodies_, at_once, *response)) return {};
  } catch (const Problem& problem) {
    response = problem.response();
  } catch (const Error& error) {
    response = response_of(error);
  } catch (const std::bad_alloc&) {
    response = Problem("failed", "out of memory").response();
  } catch (const std::exception& error) {
    response = Problem("failed", error.what()).response();
  }
  if (call.revision) response->set("X-Map-Revision", std::to_string(call.revision->number()));
  metrics_.answered(route ? route->pattern : "none", response->status, response->body ? response->body->size() : 0,
                    std::chrono::steady_clock::now() - began);
  return response;
}

}  // namespace btms
