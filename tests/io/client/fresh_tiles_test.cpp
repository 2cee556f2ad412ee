// Tiles around a vehicle against the real server, whose map changes, and which comes and goes.
#include "io/client/fresh_tiles.h"

#include <gmock/gmock.h>

#include <cmath>

#include "engine/error.h"
#include "io/export/raster.h"
#include "io/store/open_terrain.h"
#include "io/store/served_tiles.h"
#include "tests/cli/program.h"
#include "tests/io/client/fake_server.h"
#include "tests/io/client/real_server.h"

namespace btms::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
constexpr seconds kSoon{kSanitized ? 60 : 20};

// Answers as the service does, but for what a test breaks.
class BrokenServer {
 public:
  // `damage`: what becomes of the n-th answer.
  BrokenServer(const std::string& map, std::function<void(int n, const std::string& target, FakeServer::Reply&)> damage)
      : service_({.maps = {map}, .viewer = {}, .token = {}, .limits = {}}),
        damage_(std::move(damage)),
        fake_([this](const FakeRequest& request) { return answer(request); }) {}
  ClientOptions options() const { return fake_.options(); }
  void refresh() { service_.refresh(); }

 private:
  FakeServer::Reply answer(const FakeRequest& fake) {
    Request request;
    request.method = std::string(fake.method_string());
    const std::string target(fake.target());
    parse_target(target, request);
    for (const auto& field : fake) {
      std::string name(field.name_string());
      for (char& c : name) c = static_cast<char>(std::tolower(c));
      request.headers[name] = std::string(field.value());
    }
    request.body = fake.body();
    FakeServer::Reply reply;
    if (target.ends_with("/events")) {
      reply.bytes = whole("503 Busy", "", "");
    } else {
      const Response response = service_.answer(request);
      std::string headers = "Content-Type: " + response.content_type + "\r\n";
      for (const auto& [name, value] : response.headers) headers += name + ": " + value + "\r\n";
      reply.bytes = response.status == 204 ? head("204 No Content", headers)
                                           : whole(std::to_string(response.status) + " X", headers,
                                                   std::string(response.body->begin(), response.body->end()));
    }
    damage_(n_++, target, reply);
    return reply;
  }
  Service service_;
  std::function<void(int, const std::string&, FakeServer::Reply&)> damage_;
  std::atomic<int> n_{0};
  FakeServer fake_;
};

// A wall of 30 m along x at (x, y), 3 m high.
void write_wall(const std::string& file, double x_m, double y_m, double ground_m) {
  std::ostringstream rows;
  int points = 0;
  for (int i = 0; i < 300; ++i)
    for (int k = 0; k < 15; ++k, ++points) rows << x_m + 0.1 * i << " " << y_m << " " << ground_m + 0.2 * k << "\n";
  write_text(file, "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " +
                       std::to_string(points) + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
                       std::to_string(points) + "\nDATA ascii\n" + rows.str());
}

class FreshTilesOnAMap : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    made_ = new TempFolder;
    run_json({"synth", "--scene", "hills", "--points", "60000", "--density", "1", "-o", *made_ / "hills"});
    run_json({"build", *made_ / "hills", "-o", *made_ / "map.btms", "--resolution", "0.5", "--updatable"});
  }
  static void TearDownTestSuite() { delete made_; }
  void SetUp() override { fs::copy(made_->path(), folder_.path(), fs::copy_options::recursive); }

  static FreshOptions around(ClientOptions server) {
    FreshOptions options;
    options.server = std::move(server);
    options.server.answer = seconds(20);
    options.map = "map";
    options.radius_m = 400;
    options.retry = milliseconds(20);
    options.longest_retry = milliseconds(200);
    options.poll = milliseconds(50);
    return options;
  }
  double ground_m(Place place) const { return open_terrain(map_).terrain.height(place).z_m; }
  void add_wall(double x_m, double y_m) const {
    write_wall(folder_ / "wall.pcd", x_m, y_m, ground_m({x_m, y_m}));
    const Outcome outcome = run({"build", folder_ / "wall.pcd", "-o", map_, "--update", "-q"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
  }
  // Every square as the map on disk has it, every tile as the server has it, none missing.
  void expect_as_the_map(const TileSnapshot& snapshot, ClientOptions server) const {
    const auto opened = open_terrain(map_);
    const RasterLayer* layer = find_raster_layer("elevation");
    ASSERT_FALSE(snapshot.tiles.empty());
    for (const auto& [id, tile] : snapshot.tiles) {
      const Window window = cut_window(opened.terrain.tiles(), 0, ServedTiles::box_of(id), std::span(&layer, 1));
      if (tile->values.empty()) {
        EXPECT_TRUE(window.empty());
        continue;
      }
      ASSERT_EQ(tile->values.size(), window.values[0].size());
      EXPECT_EQ(std::memcmp(tile->values.data(), window.values[0].data(), tile->values.size() * sizeof(float)), 0);
    }
    MapClient client(std::move(server), "map");
    std::map<TileId, std::string> have;
    for (const auto& [id, tile] : snapshot.tiles) have[id] = tile->etag;
    const TileDiff diff = client.diff(snapshot.form, snapshot.centre, snapshot.radius_m, have);
    EXPECT_TRUE(diff.remove.empty());
    if (snapshot.all) {
      EXPECT_TRUE(diff.add.empty());
    }
    for (const TileDiff::Added& tile : diff.add) EXPECT_FALSE(have.contains(tile.id)) << "stale";
  }

  static inline TempFolder* made_ = nullptr;
  const TempFolder folder_;
  const std::string map_ = folder_ / "map.btms";
};

TEST_F(FreshTilesOnAMap, GoWithTheVehicle) {
  RealServer server(map_);
  FreshOptions options = around(server.options());
  options.radius_m = 40;
  FreshTiles fresh(options);
  EXPECT_EQ(fresh.snapshot()->number, 0u);
  EXPECT_TRUE(std::isinf(fresh.freshness().age_s));
  fresh.move_to({40, 40});
  ASSERT_TRUE(fresh.wait_until_fresh(kSoon)) << fresh.freshness().wrong;
  const auto here = fresh.snapshot();
  EXPECT_TRUE(here->all);
  EXPECT_TRUE(here->has({40, 40}));
  EXPECT_FALSE(here->has({200, 200}));
  EXPECT_TRUE(std::isnan(here->value(0, {200, 200})));
  expect_as_the_map(*here, server.options());
  // The value is the height at the middle of the square.
  EXPECT_NEAR(here->value(0, {40.3, 40.2}), ground_m({40.25, 40.25}), 1e-3);

  fresh.move_to({42, 42});  // not far enough to ask for anything
  EXPECT_EQ(fresh.snapshot()->tiles, here->tiles);
  fresh.move_to({200, 200});
  ASSERT_TRUE(fresh.wait_until_fresh(kSoon));
  const auto there = fresh.snapshot();
  EXPECT_TRUE(there->has({200, 200}));
  EXPECT_FALSE(there->has({40, 40}));
  EXPECT_TRUE(here->has({40, 40}));  // immutable
  expect_as_the_map(*there, server.options());
  // Nothing has changed; it has only come and gone.
  const std::vector<Place> everywhere = {{0, 0}, {240, 0}, {240, 240}, {0, 240}};
  EXPECT_FALSE(fresh.wait_for_change(Watch::inside(everywhere), 0, milliseconds(0)));
  EXPECT_LT(fresh.freshness().age_s, 60);
}

TEST_F(FreshTilesOnAMap, KeepToTheirBudget) {
  RealServer server(map_);
  FreshOptions options = around(server.options());
  options.budget_bytes = 3 * 128 * 128 * sizeof(float) + 100;
  FreshTiles fresh(options);
  for (const Place place : {Place{40, 40}, Place{200, 200}, Place{120, 60}, Place{-300, 40}}) {
    fresh.move_to(place);
    ASSERT_TRUE(fresh.wait_until_fresh(kSoon)) << fresh.freshness().wrong;
    const auto snapshot = fresh.snapshot();
    EXPECT_FALSE(snapshot->all);
    EXPECT_EQ(snapshot->tiles.size(), 3u);
    EXPECT_LE(snapshot->bytes(), options.budget_bytes);
    if (place.x_m > 0) {
      EXPECT_TRUE(snapshot->has(place));
    }
    expect_as_the_map(*snapshot, server.options());
  }
}

TEST_F(FreshTilesOnAMap, HearOfChangesWhereTheyAre) {
  RealServer server(map_);
  FreshTiles fresh(around(server.options()));
  fresh.move_to({120, 120});
  ASSERT_TRUE(fresh.wait_until_fresh(kSoon)) << fresh.freshness().wrong;
  const auto before = fresh.snapshot();
  add_wall(100, 100);
  const std::vector<Place> route = {{20, 101}, {115, 101}, {115, 40}}, other = {{20, 20}, {200, 20}};
  const auto after = fresh.wait_for_change(Watch::along(route, 1), before->number, kSoon);
  ASSERT_TRUE(after);
  EXPECT_GT(after->revision, before->revision);
  expect_as_the_map(*after, server.options());
  EXPECT_FALSE(fresh.wait_for_change(Watch::along(other, 1), before->number, milliseconds(0)));
  EXPECT_FALSE(fresh.wait_for_change(Watch::along(route, 1), after->number, milliseconds(0)));
  EXPECT_TRUE(fresh.freshness().streaming);
  EXPECT_EQ(fresh.freshness().wrong, "");
}

// What lies beyond the radius is known from events alone.
TEST_F(FreshTilesOnAMap, HearOfChangesFarAway) {
  RealServer server(map_);
  FreshOptions options = around(server.options());
  options.radius_m = 20;
  FreshTiles fresh(options);
  fresh.move_to({20, 20});
  ASSERT_TRUE(fresh.wait_until_fresh(kSoon));
  while (!fresh.freshness().streaming) std::this_thread::sleep_for(milliseconds(5));
  ASSERT_TRUE(fresh.wait_until_fresh(kSoon));
  const auto before = fresh.snapshot();
  ASSERT_FALSE(before->has({200, 200}));
  add_wall(200, 200);
  const std::vector<Place> there = {{215, 200}};
  EXPECT_TRUE(fresh.wait_for_change(Watch::along(there, 1), before->number, kSoon));
}

TEST_F(FreshTilesOnAMap, OutliveTheirServer) {
  auto server = std::make_unique<RealServer>(map_);
  const ClientOptions where = server->options();
  const std::uint16_t port = server->port();
  FreshTiles fresh(around(where));
  fresh.move_to({120, 120});
  ASSERT_TRUE(fresh.wait_until_fresh(kSoon));
  const auto before = fresh.snapshot();
  server.reset();
  const auto began = std::chrono::steady_clock::now();
  while (fresh.freshness().wrong.empty()) {
    ASSERT_LT(std::chrono::steady_clock::now() - began, kSoon);
    std::this_thread::sleep_for(milliseconds(5));
  }
  const double age_s = fresh.freshness().age_s;
  std::this_thread::sleep_for(milliseconds(20));
  EXPECT_GT(fresh.freshness().age_s, age_s);
  EXPECT_FALSE(fresh.freshness().streaming);
  EXPECT_EQ(fresh.snapshot()->tiles.size(), before->tiles.size());  // what it has it serves
  add_wall(100, 100);
  server = std::make_unique<RealServer>(map_, port);
  const std::vector<Place> line = {{90, 101}, {120, 101}};
  const auto after = fresh.wait_for_change(Watch::along(line, 2), before->number, kSoon);
  ASSERT_TRUE(after) << fresh.freshness().wrong;
  ASSERT_TRUE(fresh.wait_until_fresh(kSoon));
  expect_as_the_map(*fresh.snapshot(), where);
  EXPECT_EQ(fresh.freshness().wrong, "");
}

TEST_F(FreshTilesOnAMap, NeedNoServerToBegin) {
  std::uint16_t port = 0;
  { port = RealServer(map_).port(); }
  ClientOptions where;
  where.url = "http://127.0.0.1:" + std::to_string(port);
  FreshTiles fresh(around(where));
  fresh.move_to({120, 120});
  EXPECT_FALSE(fresh.wait_until_fresh(milliseconds(50)));
  EXPECT_NE(fresh.freshness().wrong, "");
  const RealServer server(map_, port);
  ASSERT_TRUE(fresh.wait_until_fresh(kSoon)) << fresh.freshness().wrong;
  expect_as_the_map(*fresh.snapshot(), where);
}

// No stream, and of three answers one is cut off, damaged or another's.
TEST_F(FreshTilesOnAMap, ArriveOverABadLine) {
  BrokenServer server(map_, [](int n, const std::string&, FakeServer::Reply& reply) {
    std::string& bytes = reply.bytes;
    if ((static_cast<unsigned>(n) * 2654435761u >> 16) % 3 != 0) return;  // in no rhythm
    if (n % 4 == 0) reply = {bytes.substr(0, bytes.size() / 2), true};
    if (n % 4 == 1) bytes[bytes.size() - std::min<std::size_t>(bytes.size(), 2000)] ^= 4;
    if (n % 4 == 2) bytes = whole("503 Busy", "Retry-After: 1\r\n", "{}");
    if (n % 4 == 3) bytes = json("{\"revision\":99999}");
  });
  FreshTiles fresh(around(server.options()));
  fresh.move_to({120, 120});
  ASSERT_TRUE(fresh.wait_until_fresh(kSoon)) << fresh.freshness().wrong;
  const auto before = fresh.snapshot();
  add_wall(100, 100);
  server.refresh();
  const std::vector<Place> line = {{90, 101}, {120, 101}};
  ASSERT_TRUE(fresh.wait_for_change(Watch::along(line, 2), before->number, kSoon)) << fresh.freshness().wrong;
  RealServer real(map_);
  expect_as_the_map(*fresh.snapshot(), real.options());
  EXPECT_FALSE(fresh.freshness().streaming);
}

TEST_F(FreshTilesOnAMap, AMapThatChangesMeanwhileIsReadAgain) {
  std::atomic<bool> once{true};
  BrokenServer* self = nullptr;
  BrokenServer server(map_, [&](int, const std::string& target, FakeServer::Reply& reply) {
    if (target.find("/events") != target.npos) reply.bytes = whole("503 Busy", "", "");  // tells nothing
    if (target.ends_with("/diff") && once.exchange(false)) {
      add_wall(100, 100);
      self->refresh();
    }
  });
  self = &server;
  FreshTiles fresh(around(server.options()));
  fresh.move_to({120, 120});
  ASSERT_TRUE(fresh.wait_until_fresh(kSoon)) << fresh.freshness().wrong;
  EXPECT_EQ(fresh.snapshot()->number, 1u);
  EXPECT_EQ(fresh.snapshot()->revision, 2u);
  RealServer real(map_);
  expect_as_the_map(*fresh.snapshot(), real.options());
}

TEST(FreshTiles, StopWhileAServerHangs) {
  FakeServer server([](const FakeRequest&) { return FakeServer::Reply{""}; });
  FreshOptions options;
  options.server = server.options();
  options.server.answer = std::chrono::minutes(5);
  options.map = "map";
  const auto began = std::chrono::steady_clock::now();
  {
    FreshTiles fresh(options);
    fresh.move_to({0, 0});
    while (server.requests == 0) std::this_thread::sleep_for(milliseconds(5));
    std::thread waiting([&] { EXPECT_FALSE(fresh.wait_until_fresh(std::chrono::minutes(5))); });
    std::this_thread::sleep_for(milliseconds(20));
    fresh.stop();
    waiting.join();
  }
  EXPECT_LT(std::chrono::steady_clock::now() - began, kSoon);
}

TEST(Watch, MeetsWhatItTouches) {
  const std::vector<Place> line = {{0, 0}, {10, 0}, {10, 10}}, square = {{0, 0}, {10, 0}, {10, 10}, {0, 10}};
  const Watch along = Watch::along(line, 1);
  EXPECT_TRUE(along.meets({4, -2, 6, -0.5}));
  EXPECT_FALSE(along.meets({4, -3, 6, -1.5}));
  EXPECT_FALSE(along.meets({2, 3, 8, 8}));
  EXPECT_TRUE(along.meets({10.5, 4, 20, 5}));
  EXPECT_TRUE(along.meets({-50, -50, 50, 50}));
  const Watch inside = Watch::inside(square);
  EXPECT_TRUE(inside.meets({4, 4, 5, 5}));
  EXPECT_TRUE(inside.meets({-1, 4, 1, 5}));
  EXPECT_FALSE(inside.meets({11, 4, 12, 5}));
  const double far = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(along.meets({-far, -far, far, far}));
  EXPECT_FALSE(Watch::along({}, 1).meets({-far, -far, far, far}));
}

}  // namespace
}  // namespace btms::test
