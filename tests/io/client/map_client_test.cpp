// A map's answers that are not what was asked for.
#include "io/client/map_client.h"

#include <gmock/gmock.h>

#include <cmath>

#include "engine/error.h"
#include "io/client/event_stream_reader.h"
#include "io/client/multipart.h"
#include "io/export/raw_tile.h"
#include "io/store/served_tiles.h"
#include "tests/io/client/fake_server.h"

namespace btms::test {
namespace {

using testing::HasSubstr;
using Reply = FakeServer::Reply;

const std::string kTag = "xxh3:0123456789abcdef0123456789abcdef";
const std::string kOtherTag = "xxh3:ffffffffffffffffffffffffffffffff";
const TileForm kForm{0, 2.0, {"elevation"}};

std::string raw_of(TileId id, double cell_m = 2) {
  Window window;
  window.level = 0;
  window.rows = window.cols = kServedCells;
  window.cell_m = cell_m;
  window.min_x_m = id.tx * cell_m * kServedCells;
  window.min_y_m = id.ty * cell_m * kServedCells;
  window.values.emplace_back(window.rows * window.cols, 1.5f);
  const auto bytes = raw_tile(window, id);
  return {bytes.begin(), bytes.end()};
}
std::string tile_answer(const std::string& raw, const std::string& tag = kTag) {
  return whole("200 OK", "Content-Type: application/octet-stream\r\nETag: \"" + tag + "\"\r\n", raw);
}
std::string part(const std::string& id, const std::string& raw) {
  return "--b\r\nContent-Location: " + id + "\r\nETag: \"" + kTag +
         "\"\r\nContent-Length: " + std::to_string(raw.size()) + "\r\n\r\n" + raw + "\r\n";
}
std::string bundle_answer(const std::string& parts) {
  return whole("200 OK", "Content-Type: multipart/mixed; boundary=b\r\n", parts);
}

// Runs `ask` against a server that answers so.
template <class Ask>
ErrorCode code_of(const std::string& bytes, const Ask& ask) {
  FakeServer server([&](const FakeRequest&) { return Reply{bytes}; });
  MapClient client(server.options(), "city");
  try {
    ask(client);
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode::kCancelled;  // no error
}
constexpr ErrorCode kFine = ErrorCode::kCancelled;

TEST(MapClient, BelievesATileOnlyWhenAllOfItFits) {
  const auto ask = [](MapClient& client) { client.tile(kForm, {3, -1}); };
  const std::string raw = raw_of({3, -1});
  EXPECT_EQ(code_of(tile_answer(raw), ask), kFine);
  std::string flipped = raw;
  flipped[5000] ^= 1;
  EXPECT_EQ(code_of(tile_answer(flipped), ask), ErrorCode::kVerification);
  EXPECT_EQ(code_of(tile_answer(raw.substr(0, raw.size() - 4)), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(tile_answer(raw + "1234"), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(tile_answer(raw_of({3, 1})), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(tile_answer(raw_of({3, -1}, 4)), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(tile_answer(raw, "something"), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(whole("200 OK", "", raw), ask), ErrorCode::kBadInput);  // no validator
  EXPECT_EQ(code_of(tile_answer(""), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(head("304 Not Modified", "ETag: \"" + kTag + "\"\r\n"), ask), ErrorCode::kBadInput);  // unasked
}

TEST(MapClient, UnchangedAndEmptyTiles) {
  FakeServer server([](const FakeRequest& request) {
    if (request[http::field::if_none_match] == "\"" + kTag + "\"")
      return Reply{head("304 Not Modified", "ETag: \"" + kTag + "\"\r\n")};
    if (request[http::field::if_none_match] == "\"" + kOtherTag + "\"")
      return Reply{head("304 Not Modified", "ETag: \"" + kTag + "\"\r\n")};
    EXPECT_EQ(request.target(), "/v1/maps/city/tiles/0/3/-1?layers=elevation&f=raw");
    return Reply{head("204 No Content", "ETag: \"" + kTag + "\"\r\n")};
  });
  MapClient client(server.options(), "city");
  EXPECT_FALSE(client.tile(kForm, {3, -1}, kTag));
  EXPECT_THROW(client.tile(kForm, {3, -1}, kOtherTag), Error);
  const auto empty = client.tile(kForm, {3, -1});
  ASSERT_TRUE(empty);
  EXPECT_TRUE(empty->values.empty());
  EXPECT_EQ(empty->etag, kTag);
  EXPECT_EQ(empty->bounds_m, (BoxM{768, -256, 1024, 0}));
}

TEST(MapClient, ABundleIsWhatWasAskedFor) {
  const std::vector<TileId> ids = {{0, 0}, {1, 0}};
  const auto ask = [&](MapClient& client) { EXPECT_EQ(client.bundle(kForm, ids).size(), 2u); };
  const std::string a = part("0/0/0", raw_of({0, 0})), b = part("0/1/0", raw_of({1, 0})), end = "--b--\r\n";
  EXPECT_EQ(code_of(bundle_answer(a + b + end), ask), kFine);
  EXPECT_EQ(code_of(bundle_answer(a + part("0/1/0", "") + end), ask), kFine);
  EXPECT_EQ(code_of(bundle_answer(b + a + end), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(bundle_answer(a + end), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(bundle_answer(a + b + b + end), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(bundle_answer(a + b), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(bundle_answer(a + b + end + "more"), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(bundle_answer(a + part("0/1/0", raw_of({0, 0})) + end), ask), ErrorCode::kBadInput);
  std::string longer = a + b + end;
  longer.replace(longer.find("Content-Length: 65600"), 21, "Content-Length: 65601");
  EXPECT_EQ(code_of(bundle_answer(longer), ask), ErrorCode::kBadInput);
  longer.replace(longer.find("Content-Length: 65601"), 21, "Content-Length: 99999");
  EXPECT_EQ(code_of(bundle_answer(longer), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(whole("200 OK", "Content-Type: text/plain\r\n", a + b + end), ask), ErrorCode::kBadInput);
}

TEST(MapClient, ADiffIsOfTheLevelAndOfWhatIsHeld) {
  const auto ask = [](MapClient& client) { client.diff(kForm, {0, 0}, 100, {{{1, 1}, kTag}}); };
  const auto with = [](const std::string& add, const std::string& remove) {
    return json("{\"revision\":4,\"add\":[" + add + "],\"remove\":[" + remove + "],\"keep\":0}");
  };
  const std::string one = "{\"id\":\"0/2/2\",\"etag\":\"" + kTag + "\"}";
  EXPECT_EQ(code_of(with(one, "\"0/1/1\""), ask), kFine);
  EXPECT_EQ(code_of(with(one + "," + one, ""), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(with("", "\"0/2/2\""), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(with("{\"id\":\"1/2/2\",\"etag\":\"" + kTag + "\"}", ""), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(with("{\"id\":\"0/2/2\",\"etag\":\"x\"}", ""), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(with("7", ""), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(json("[]"), ask), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(json("{\"revision\":-1,\"add\":[],\"remove\":[]}"), ask), ErrorCode::kBadInput);
}

TEST(MapClient, BadJson) {
  for (const std::string body : {"", "{", "[]", "null", "{\"revision\":\"x\"}", "\"\\ud800\"", "{\"a\":1e999}"}) {
    EXPECT_EQ(code_of(json(body), [](MapClient& c) { c.description(); }), ErrorCode::kBadInput) << body;
    EXPECT_EQ(code_of(json(body), [](MapClient& c) { c.height({1, 2}); }), ErrorCode::kBadInput) << body;
    EXPECT_EQ(code_of(json(body), [](MapClient& c) { c.heights(std::vector<Place>{{1, 2}}); }), ErrorCode::kBadInput);
    EXPECT_EQ(code_of(json(body),
                      [](MapClient& c) {
                        c.profile(std::vector<Place>{{1, 2}}, 1);
                      }),
              ErrorCode::kBadInput);
    EXPECT_EQ(code_of(json(body),
                      [](MapClient& c) {
                        c.check_path(std::vector<Place>{{1, 2}});
                      }),
              ErrorCode::kBadInput);
    EXPECT_EQ(code_of(json(body), [](MapClient& c) { c.route({1, 2}, {3, 4}); }), ErrorCode::kBadInput);
    EXPECT_EQ(code_of(json(body), [](MapClient& c) { c.events(3); }), ErrorCode::kBadInput);
  }
  EXPECT_EQ(code_of(json(std::string(100'000, '[')), [](MapClient& c) { c.description(); }), ErrorCode::kBadInput);
  EXPECT_EQ(code_of(json("{\"revision\":1,\"is_safe\":true,\"traversability\":1,\"first_bad\":{\"x\":1,\"y\":1,"
                         "\"reason\":\"step\"}}"),
                    [](MapClient& c) {
                      c.check_path(std::vector<Place>{{1, 2}});
                    }),
            ErrorCode::kBadInput);
  EXPECT_EQ(
      code_of(json("{\"revision\":1,\"status\":\"found\",\"points\":[],\"length_m\":0,\"weight\":0,\"settled\":0}"),
              [](MapClient& c) {
                c.route({1, 2}, {3, 4});
              }),
      ErrorCode::kBadInput);
}

TEST(EventStreamReader, FromAnyPieces) {
  const std::string text =
      ": hello\n\nid: 3\nevent: tiles\ndata: {\"a\":\ndata: 1}\n\n:\n\nid: 4\r\nevent: reset\r\n\r\n";
  for (std::size_t piece : {1, 3, 7, 1000}) {
    EventStreamReader reader(1000);
    std::vector<ServerSentEvent> events;
    for (std::size_t at = 0; at < text.size(); at += piece) {
      reader.feed(std::string_view(text).substr(at, piece));
      while (auto event = reader.next()) events.push_back(*event);
    }
    ASSERT_EQ(events.size(), 2u) << piece;
    EXPECT_EQ(events[0].id + events[0].name + events[0].data, "3tiles{\"a\":\n1}");
    EXPECT_EQ(events[1].id + events[1].name, "4reset");
  }
}

TEST(EventStreamReader, IsBounded) {
  EventStreamReader reader(1000);
  EXPECT_THROW(
      {
        for (int i = 0; i < 100; ++i) {
          reader.feed("data: " + std::string(30, 'x') + "\n");
          reader.next();
        }
      },
      Error);
  EventStreamReader no_lines(1000);
  no_lines.feed(std::string(900, 'x'));
  EXPECT_FALSE(no_lines.next());
  EXPECT_THROW(no_lines.feed(std::string(200, 'x')), Error);
}

}  // namespace
}  // namespace btms::test
