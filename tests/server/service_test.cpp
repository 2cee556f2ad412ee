// The service without sockets.
#include <cmath>
#include <cstring>
#include <set>

#include "apps/server/problem.h"
#include "engine/routing/route.h"
#include "io/export/raw_tile.h"
#include "io/store/open_terrain.h"
#include "tests/server/served_city.h"

namespace btms::test {
namespace {

using ServiceAnswers = AnsweredCity;

TEST_F(ServiceAnswers, DescribesItsMaps) {
  EXPECT_EQ(json(ask("/v1/maps"))[0]["id"], "city");
  const Response facts = ask("/v1/maps/city");
  EXPECT_EQ(facts.status, 200);
  EXPECT_EQ(header(facts, "X-Map-Revision"), "1");
  EXPECT_EQ(json(facts)["levels"][0]["cell_m"], 2.0);
  Request again = get("/v1/maps/city");
  again.headers["if-none-match"] = header(facts, "ETag");
  EXPECT_EQ(ask(again).status, 304);
  EXPECT_EQ(json(ask("/readyz"))["maps"]["city"], 1);
}

TEST_F(ServiceAnswers, TilesAreWhatTheMapHolds) {
  const Terrain terrain = open_terrain(map_path()).terrain;
  const nlohmann::json list = json(ask("/v1/maps/city/tiles?level=0"))["tiles"];
  ASSERT_GT(list.size(), 0u);
  std::size_t compared = 0;
  for (const auto& entry : list) {
    const Response tile = ask("/v1/maps/city/tiles/" + entry["id"].get<std::string>() + "?layers=elevation");
    ASSERT_EQ(tile.status, 200) << entry;
    EXPECT_EQ(header(tile, "ETag"), "\"" + entry["etag"].get<std::string>() + "\"");
    const RawHeader raw = parse_raw_tile(*tile.body);
    std::vector<float> values(raw.rows * raw.cols);
    ASSERT_EQ(tile.body->size(), kRawHeader_bytes + values.size() * sizeof(float));
    std::memcpy(values.data(), tile.body->data() + kRawHeader_bytes, values.size() * sizeof(float));
    for (std::uint32_t row = 0; row < raw.rows; ++row)
      for (std::uint32_t col = 0; col < raw.cols; ++col) {
        const Place middle{raw.min_x_m + (col + 0.5) * raw.cell_m, raw.min_y_m + (raw.rows - row - 0.5) * raw.cell_m};
        const HeightAnswer height = terrain.height(middle);
        const float value = values[row * raw.cols + col];
        if (height.status != QueryStatus::kOk) {
          ASSERT_TRUE(std::isnan(value));
          continue;
        }
        ASSERT_EQ(value, static_cast<float>(height.z_m));
        ++compared;
      }
  }
  EXPECT_GT(compared, 10000u);
}

TEST_F(ServiceAnswers, AnUnchangedTileIsNotSentAgain) {
  const std::string target = "/v1/maps/city/tiles/0/0/0";
  const Response tile = ask(target);
  for (const std::string& tags : {header(tile, "ETag"), "\"other\", " + header(tile, "ETag"), std::string("*")}) {
    Request again = get(target);
    again.headers["if-none-match"] = tags;
    const Response answer = ask(again);
    EXPECT_EQ(answer.status, 304) << tags;
    EXPECT_FALSE(answer.body && !answer.body->empty());
    EXPECT_EQ(header(answer, "ETag"), header(tile, "ETag"));
  }
  std::set<std::string> etags;
  for (const char* form : {"?f=raw", "?f=npy", "?f=raw&layers=slope", "?f=tif", "?f=png", "?f=json"})
    EXPECT_TRUE(etags.insert(header(ask(target + form), "ETag")).second) << form;
}

TEST_F(ServiceAnswers, SaysWhatIsWrong) {
  const std::string m = "/v1/maps/city";
  const std::tuple<std::string, int, std::string> wrong[] = {
      {"/v1/maps/town", 404, "unknown_map"},
      {"/v1/maps/..", 404, "unknown_map"},
      {"/v1/maps/city%2F..", 404, "unknown_map"},
      {m + "/nothing", 404, "not_found"},
      {m + "/tiles?level=99", 404, "unknown_level"},
      {m + "/tiles?level=0.5", 404, "unknown_level"},
      {m + "/tiles", 400, "bad_parameter"},
      {m + "/tiles/99/0/0", 404, "unknown_level"},
      {m + "/tiles/-1/0/0", 404, "unknown_level"},
      {m + "/tiles/0/99999/0", 404, "outside"},
      {m + "/tiles/0/9999999999999999999/0", 400, "bad_parameter"},
      {m + "/tiles/0/x/0", 400, "bad_parameter"},
      {m + "/tiles/0/0/0?f=exe", 400, "bad_parameter"},
      {m + "/tiles/0/0/0?layers=gold", 400, "bad_parameter"},
      {m + "/tiles/0/0/0?layers=elevation,elevation", 400, "bad_parameter"},
      {m + "/height?x=nan&y=0", 400, "bad_parameter"},
      {m + "/height?x=inf&y=0", 400, "bad_parameter"},
      {m + "/height?x=1", 400, "bad_parameter"},
      {m + "/height?x=1e9&y=0", 404, "outside"},
      {m + "/submap?cx=0&cy=0&lx=-1&ly=1", 400, "bad_parameter"},
      {m + "/submap?cx=0&cy=0&lx=1e8&ly=1e8", 413, "too_much"},
      {m + "/submap?cx=0&cy=0&lx=10&ly=10&res=1e-9", 400, "bad_parameter"},
      {m + "/costmap", 400, "bad_parameter"},
      {m + "/costmap?bbox=10,10,0,0", 400, "bad_parameter"},
      {m + "/costmap?bbox=0,0,10,10&mode=loud", 400, "bad_parameter"},
      {m + "/events?since=-1", 400, "bad_parameter"},
      {m + "/events?bbox=1,2,3", 400, "bad_parameter"},
  };
  for (const auto& [target, status, code] : wrong) {
    const Response answer = ask(target);
    EXPECT_EQ(answer.status, status) << target << text(answer);
    EXPECT_EQ(code_of(answer), code) << target;
    EXPECT_EQ(answer.content_type, "application/problem+json") << target;
  }
}

TEST_F(ServiceAnswers, BodiesAreHeldAgainstWhatIsExpected) {
  const std::pair<const char*, const char*> wrong[] = {
      {"diff", ""},
      {"diff", "[]"},
      {"diff", "{"},
      {"diff", R"({"area": {}})"},
      {"diff", R"({"area": {"center": [0, 0], "radius": -1}})"},
      {"diff", R"({"area": {"center": [0, 0], "radius": 1e300}})"},
      {"diff", R"({"area": {"bbox": [1, 1, 0, 0]}})"},
      {"diff", R"({"area": {"polygon": [[0, 0], [1, 1]]}})"},
      {"diff", R"({"area": {"center": [0, 0], "radius": 1}, "have": 7})"},
      {"diff", R"({"area": {"center": [0, 0], "radius": 1}, "f": 7})"},
      {"bundle", R"({"ids": 7})"},
      {"bundle", R"({"ids": [7]})"},
      {"bundle", R"({"ids": ["0/0"]})"},
      {"bundle", R"({"ids": ["0/0/0"], "f": 7})"},
      {"bundle", R"({"ids": ["0/0/0"], "f": "exe"})"},
      {"height", R"({"points": [[1]]})"},
      {"height", R"({"points": [[1, "x"]]})"},
      {"height", R"({"points": [[1, 1e999]]})"},
      {"profile", R"({"line": []})"},
      {"profile", R"({"encoded_polyline": "\u0001"})"},
      {"profile", R"({"encoded_polyline": 5})"},
      {"profile", R"({"line": [[0, 0]], "height_precision": 99})"},
      {"check", R"({"path": []})"},
      {"check", R"({"path": [[0, 0]], "footprint": [[0, 0]]})"},
      {"check", R"({"path": [[0, 0]], "radius": -1})"},
      {"check", R"({"path": [[0, 0]], "limits": {"unknown": "maybe"}})"},
      {"check", R"({"polygons": [[[0, 0], [1, 0]]]})"},
      {"route", R"({"from": [0, 0]})"},
      {"route", R"({"from": [0, 0], "to": [1]})"},
      {"route", R"({"from": [0, 0], "to": [1, 1], "width_m": -1})"},
      {"route", R"({"from": [0, 0], "to": [1, 1], "cost_weight": -1})"},
  };
  for (const auto& [what, body] : wrong) {
    const Response answer = ask(post(std::string("/v1/maps/city/") + what, body));
    EXPECT_EQ(answer.status, 400) << what << " " << body << text(answer);
    EXPECT_EQ(answer.content_type, "application/problem+json") << what << " " << body;
  }
  // Nested deeper than a reader's stack.
  EXPECT_EQ(ask(post("/v1/maps/city/diff", std::string(100'000, '['))).status, 400);
  const std::string line = R"({"line": [[0, 0], [1e6, 0]], "resample_distance": 1e-3})";
  EXPECT_EQ(ask(post("/v1/maps/city/profile", line)).status, 413);
  std::string many = R"({"ids": [)";
  for (int i = 0; i < 300; ++i) many += (i ? "," : "") + std::string("\"0/0/0\"");
  EXPECT_EQ(ask(post("/v1/maps/city/bundle", many + "]}")).status, 413);
}

TEST_F(ServiceAnswers, OnlyTheRightMethods) {
  EXPECT_EQ(ask(post("/v1/maps", "")).status, 405);
  EXPECT_EQ(ask(request("DELETE", "/v1/maps/city")).status, 405);
  EXPECT_EQ(ask(get("/v1/maps/city/diff")).status, 405);
  const Response both = ask(request("PUT", "/v1/maps/city/height"));
  EXPECT_EQ(both.status, 405);
  EXPECT_EQ(header(both, "Allow"), "GET, POST, HEAD");
  EXPECT_EQ(ask(request("HEAD", "/v1/maps")).status, 200);
}

TEST_F(ServiceAnswers, HeightsAreThoseOfTheLibrary) {
  const Terrain terrain = open_terrain(map_path()).terrain;
  std::vector<double> places;
  nlohmann::json points = nlohmann::json::array();
  for (int i = 0; i < 500; ++i) {
    places.push_back(std::fmod(i * 37.7, 170));
    places.push_back(std::fmod(i * 71.3, 170));
    points.push_back({places[places.size() - 2], places.back()});
  }
  const nlohmann::json heights =
      json(ask(post("/v1/maps/city/height", nlohmann::json{{"points", points}}.dump())))["heights"];
  Request binary = post("/v1/maps/city/height", {reinterpret_cast<const char*>(places.data()), places.size() * 8});
  binary.headers["content-type"] = "application/octet-stream";
  const Response packed = ask(binary);
  ASSERT_EQ(packed.body->size(), 500u * 24);
  for (std::size_t i = 0; i < 500; ++i) {
    const HeightAnswer height = terrain.height({places[2 * i], places[2 * i + 1]});
    double z = 0;
    std::memcpy(&z, packed.body->data() + 24 * i, 8);
    if (height.status == QueryStatus::kOk) {
      ASSERT_EQ(heights[i]["z"].get<double>(), height.z_m);
      ASSERT_EQ(z, height.z_m);
    } else {
      ASSERT_TRUE(heights[i]["z"].is_null());
    }
    ASSERT_EQ(heights[i]["status"], query_status_name(height.status));
  }
}

TEST_F(ServiceAnswers, DiffsEndWithNothingToDo) {
  nlohmann::json asked{{"area", {{"center", {80, 80}}, {"radius", 100}}}};
  const nlohmann::json first = json(ask(post("/v1/maps/city/diff", asked.dump())));
  ASSERT_GT(first["add"].size(), 0u);
  EXPECT_EQ(first["keep"], 0);
  asked["have"] = {{"0/50/50", "xxh3:0"}};
  nlohmann::json ids = nlohmann::json::array();
  for (const auto& tile : first["add"]) {
    asked["have"][tile["id"].get<std::string>()] = tile["etag"];
    ids.push_back(tile["id"]);
    EXPECT_EQ(header(ask(tile["url"].get<std::string>()), "ETag"), "\"" + tile["etag"].get<std::string>() + "\"");
  }
  const nlohmann::json second = json(ask(post("/v1/maps/city/diff", asked.dump())));
  EXPECT_EQ(second["add"].size(), 0u);
  EXPECT_EQ(second["keep"], first["add"].size());
  EXPECT_EQ(second["remove"], nlohmann::json::array({"0/50/50"}));
  const Response bundle = ask(post("/v1/maps/city/bundle", nlohmann::json{{"ids", ids}}.dump()));
  EXPECT_TRUE(bundle.content_type.starts_with("multipart/mixed"));
  for (const auto& tile : first["add"])
    EXPECT_NE(text(bundle).find("ETag: \"" + tile["etag"].get<std::string>() + "\""), std::string::npos);
}

TEST_F(ServiceAnswers, RoutesAreThoseOfTheLibrary) {
  const auto [reader, terrain] = open_terrain(map_path());
  RouteRules rules;
  rules.width_m = reader->info().parameters.vehicle_width_m;
  rules.limits = limits_of(reader->info().parameters);
  const TraversalGraph graph(terrain, reader->info().parameters);
  int found = 0;
  for (int i = 0; i < 12; ++i) {
    const Place from{10.0 + 11 * i, 20}, to{150.0 - 9 * i, 140};
    const Route route = find_route(graph, from, to, rules);
    const nlohmann::json said = json(ask(
        post("/v1/maps/city/route", nlohmann::json{{"from", {from.x_m, from.y_m}}, {"to", {to.x_m, to.y_m}}}.dump())));
    EXPECT_EQ(said["status"], route_status_name(route.status));
    ASSERT_EQ(said["points"].size(), route.points.size());
    EXPECT_NEAR(said["length_m"].get<double>(), route.length_m, 1e-3);
    found += route.status == RouteStatus::kFound;
  }
  EXPECT_GT(found, 0);
}

TEST_F(ServiceAnswers, AsksForTheToken) {
  ServiceOptions options = ServedCity::options();
  options.token = "sesame";
  const Service guarded(options);
  EXPECT_EQ(guarded.answer(get("/v1/maps")).status, 401);
  EXPECT_EQ(guarded.answer(get("/v1/maps/city/tiles/0/0/0")).status, 401);
  EXPECT_EQ(guarded.answer_at_once(get("/v1/maps/city/tiles/0/0/0"))->status, 401);
  EXPECT_EQ(guarded.answer(get("/healthz")).status, 200);
  for (const char* said : {"Bearer sesame", "Bearer sesam", "Bearer sesamee", "sesame", "Bearer "}) {
    Request request = get("/v1/maps");
    request.headers["authorization"] = said;
    EXPECT_EQ(guarded.answer(request).status, std::string(said) == "Bearer sesame" ? 200 : 401) << said;
  }
}

std::string value_of(const std::string& parameter, const std::string& pattern) {
  if (parameter == "bbox") return "0,0,40,40";
  if (parameter == "level") return "0";
  if (parameter != "coords") return "30";
  if (pattern.ends_with("position")) return "POINT(30%2030)";
  return pattern.ends_with("area") ? "POLYGON((30%2030,40%2030,40%2040,30%2030))" : "LINESTRING(30%2030,40%2030)";
}

TEST_F(ServiceAnswers, OpenApiListsWhatIsAnswered) {
  const nlohmann::json api = json(ask("/openapi.json"));
  EXPECT_EQ(api["openapi"], "3.0.3");
  std::size_t tried = 0;
  for (const auto& [pattern, operations] : api["paths"].items())
    for (const auto& [method, operation] : operations.items()) {
      std::string target = pattern;
      for (const auto& [name, value] :
           std::map<std::string, std::string>{{"{map}", "city"}, {"{level}", "0"}, {"{column}", "0"}, {"{row}", "0"}})
        if (const std::size_t at = target.find(name); at != std::string::npos) target.replace(at, name.size(), value);
      std::string query;
      for (const auto& parameter : operation["parameters"])
        if (parameter["in"] == "query" && parameter["required"].get<bool>())
          query += (query.empty() ? "?" : "&") + parameter["name"].get<std::string>() + "=" +
                   value_of(parameter["name"], pattern);
      const bool posts = method == "post";
      const Response answer =
          ask(posts ? post(target, operation["requestBody"]["content"]["application/json"]["example"].dump())
                    : get(target + query));
      if (pattern.starts_with("/xyz/{map}/")) continue;  // the tile of the whole world: nothing there is that large
      EXPECT_EQ(answer.status, 200) << method << " " << target << query << text(answer);
      const std::string type = answer.content_type.substr(0, answer.content_type.find(';'));
      EXPECT_TRUE(operation["responses"]["200"]["content"].contains(type)) << pattern << " gives " << type;
      ++tried;
    }
  EXPECT_EQ(tried + 2, endpoints().size());
}

TEST_F(ServiceAnswers, ARequestSeesOneRevision) {
  ServiceOptions options = ServedCity::options();
  Service service(options);
  const Response before = service.answer(get("/v1/maps/city"));
  const Response stream = service.answer(get("/v1/maps/city/events"));
  ASSERT_TRUE(stream.events);
  EXPECT_TRUE(service.refresh().empty());
  EXPECT_EQ(stream.events->take(), "");
  EXPECT_EQ(service.answer(get("/v1/maps/city/events?since=1")).status, 204);
  const std::string tile = "/v1/maps/city/tiles/0/0/0";
  const std::string old_tag = header(service.answer(get(tile)), "ETag");

  run_json({"synth", "--points", "20000", "--seed", "7", "-o", folder() / "more"});
  run_json({"build", folder() / "more", "-o", map_path(), "--update"});
  EXPECT_EQ(header(service.answer(get("/v1/maps/city")), "X-Map-Revision"), "1") << "not before it is told";
  EXPECT_TRUE(service.refresh().empty());
  const Response after = service.answer(get("/v1/maps/city"));
  EXPECT_EQ(header(after, "X-Map-Revision"), "2");
  EXPECT_NE(header(after, "ETag"), header(before, "ETag"));
  EXPECT_NE(header(service.answer(get(tile)), "ETag"), old_tag);
  const std::string event = stream.events->take();
  EXPECT_TRUE(event.starts_with("id: 2\nevent: tiles\ndata: {")) << event;
  const nlohmann::json missed = json(service.answer(get("/v1/maps/city/events?since=1")));
  EXPECT_EQ(missed["reset"], false);
  EXPECT_EQ(missed["events"][0]["revision"], 2);
  EXPECT_GT(missed["events"][0]["tiles"].size(), 0u);
  Request resumed = get("/v1/maps/city/events");
  resumed.headers["last-event-id"] = "1";
  EXPECT_EQ(service.answer(resumed).events->take(), event);
  resumed.headers["last-event-id"] = "77";
  EXPECT_NE(service.answer(resumed).events->take().find("event: reset"), std::string::npos);
}

TEST_F(ServiceAnswers, SurvivesOddTargets) {
  for (const std::string target :
       {"/", "//", "/%00", "/..%2f..%2fetc/passwd", "/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd",
        "/v1/maps/%F0%9F%8C%8D", "/v1/maps/city/tiles/0/0/0?layers=%00", "/v1/maps/city/tiles/0/0/0?&&==&a=b=c",
        "/v1/maps/city/tiles/+0/0/0", "/v1/maps/city/tiles/0/0/0/0", "/v1//maps"}) {
    try {
      const Response answer = ask(target);
      EXPECT_TRUE(answer.status == 200 || answer.status == 400 || answer.status == 404) << target << answer.status;
      EXPECT_EQ(text(answer).find("root:"), std::string::npos);
    } catch (const Problem& problem) {
      EXPECT_EQ(problem.status(), 400) << target;
    }
  }
}

}  // namespace
}  // namespace btms::test
