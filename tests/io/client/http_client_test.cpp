// HTTP against a server that does what it should not.
#include "io/client/http_client.h"

#include <gmock/gmock.h>

#include "engine/error.h"
#include "io/client/server_url.h"
#include "tests/io/client/fake_server.h"

namespace btms::test {
namespace {

using testing::HasSubstr;
using Reply = FakeServer::Reply;

// The error of one request to a server that answers so, as code and text.
std::pair<ErrorCode, std::string> error_of(const Reply& reply, const std::function<void(ClientOptions&)>& change = {}) {
  FakeServer server([&](const FakeRequest&) { return reply; });
  ClientOptions options = server.options();
  if (change) change(options);
  try {
    HttpClient(options).get("/a");
  } catch (const Error& error) {
    return {error.code(), error.what()};
  }
  return {ErrorCode::kCancelled, "no error"};
}
void expect_error(const Reply& reply, ErrorCode code, const std::string& text,
                  const std::function<void(ClientOptions&)>& change = {}) {
  const auto [got, said] = error_of(reply, change);
  EXPECT_EQ(got, code) << said;
  EXPECT_THAT(said, HasSubstr(text));
}

TEST(HttpClient, KeepsItsConnection) {
  FakeServer server([](const FakeRequest& request) {
    EXPECT_EQ(request[http::field::authorization], "Bearer secret");
    return Reply{whole("200 OK", "X-Thing: 7\r\n", std::string(request.target()) + request.body())};
  });
  ClientOptions options = server.options();
  options.url += "/below/";
  options.token = "secret";
  HttpClient client(options);
  for (int i = 0; i < 5; ++i) {
    const HttpAnswer answer = client.get("/a");
    EXPECT_EQ(std::string(answer.body.begin(), answer.body.end()), "/below/a");
    EXPECT_EQ(answer.header("x-thing"), "7");
  }
  const std::string text = "body";
  const HttpAnswer answer =
      client.post("/b", std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()), "text/plain");
  EXPECT_EQ(std::string(answer.body.begin(), answer.body.end()), "/below/bbody");
  EXPECT_EQ(server.connections, 1);
}

TEST(HttpClient, AStaleConnectionIsTriedOnceMore) {
  FakeServer server([](const FakeRequest&) { return Reply{whole("200 OK", "", "x"), true}; });
  HttpClient client(server.options());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(client.get("/").body.size(), 1u);
  EXPECT_EQ(server.requests, 3);
  EXPECT_EQ(server.connections, 3);
}

TEST(HttpClient, ANewConnectionThatDiesIsNot) {
  FakeServer server([](const FakeRequest&) { return Reply{"", true}; });
  HttpClient client(server.options());
  EXPECT_THROW(client.get("/"), Error);
  EXPECT_EQ(server.requests, 1);
}

TEST(HttpClient, RefusesWhatIsNotWhole) {
  expect_error({head("200 OK", "Content-Length: 100\r\n") + "short", true}, ErrorCode::kFailed, "ended before");
  expect_error({head("200 OK", "Transfer-Encoding: chunked\r\n") + "5\r\nabc", true}, ErrorCode::kFailed,
               "ended before");
  expect_error({head("200 OK", "") + "until the end", true}, ErrorCode::kBadInput, "how long");
  expect_error({head("200 OK", "Content-Length: 5\r\nTransfer-Encoding: chunked\r\n") + "0\r\n\r\n", true},
               ErrorCode::kBadInput, "does not speak HTTP");
  expect_error({head("200 OK", "Content-Length: 5\r\nContent-Length: 6\r\n") + "abcdef", true}, ErrorCode::kBadInput,
               "does not speak HTTP");
  expect_error({"hello, world, this is no web server\r\n\r\n", true}, ErrorCode::kBadInput, "does not speak HTTP");
}

TEST(HttpClient, BoundsHeadersAndBodies) {
  expect_error({head("200 OK", "X-Long: " + std::string(100'000, 'x') + "\r\n")}, ErrorCode::kBadInput,
               "header is too long");
  std::string many;
  for (int i = 0; i < 5000; ++i) many += "X-" + std::to_string(i) + ": 1\r\n";
  expect_error({head("200 OK", many)}, ErrorCode::kBadInput, "header is too long");
  const auto small = [](ClientOptions& options) { options.body_bytes = 1000; };
  expect_error({head("200 OK", "Content-Length: 1001\r\n")}, ErrorCode::kBadInput, "too long", small);
  expect_error({head("200 OK", "Content-Length: 99999999999999\r\n")}, ErrorCode::kBadInput, "too long");
  std::string endless = head("200 OK", "Transfer-Encoding: chunked\r\n");
  for (int i = 0; i < 200; ++i) endless += "10\r\n0123456789abcdef\r\n";
  expect_error({endless}, ErrorCode::kBadInput, "too long", small);
}

TEST(HttpClient, HasDeadlines) {
  const auto soon = [](ClientOptions& options) { options.answer = std::chrono::milliseconds(150); };
  expect_error({""}, ErrorCode::kFailed, "too long", soon);
  // Every piece is in time, all of them are not.
  expect_error({whole("200 OK", "", std::string(1000, 'x')), false, std::chrono::milliseconds(20), 10},
               ErrorCode::kFailed, "took too long", soon);
  ClientOptions nobody;
  {
    FakeServer server([](const FakeRequest&) { return Reply{}; });
    nobody = server.options();
  }
  EXPECT_THROW(HttpClient(nobody).get("/"), Error);
}

TEST(HttpClient, StatusesAreErrorsThatSayWhy) {
  const std::string problem = "{\"code\":\"busy\",\"title\":\"T\",\"detail\":\"wait\\u0007 a bit\"}";
  expect_error({whole("503 Busy", "", problem)}, ErrorCode::kFailed, "503: busy: T: wait? a bit");
  expect_error({whole("404 No", "", "not json")}, ErrorCode::kUsage, "404");
  expect_error({whole("302 Found", "Location: http://127.0.0.1:1/\r\n", "")}, ErrorCode::kBadInput, "points elsewhere");
  expect_error({whole("200 OK", "Content-Encoding: gzip\r\n", "xxx")}, ErrorCode::kBadInput, "packed");
  expect_error({"HTTP/1.1 101 Switching\r\n\r\n", true}, ErrorCode::kBadInput, "101");
}

TEST(HttpClient, AnErrorKeepsTheConnection) {
  FakeServer server([](const FakeRequest&) { return Reply{whole("503 Busy", "", "")}; });
  HttpClient client(server.options());
  for (int i = 0; i < 3; ++i) EXPECT_THROW(client.get("/"), Error);
  EXPECT_EQ(server.connections, 1);
}

// Bytes after an answer are not the next answer.
TEST(HttpClient, WhatFollowsAnAnswerIsForgotten) {
  FakeServer server([](const FakeRequest& request) {
    return Reply{whole("200 OK", "", std::string(request.target())) + whole("200 OK", "", "/false")};
  });
  HttpClient client(server.options());
  for (const std::string target : {"/one", "/two"}) {
    const HttpAnswer answer = client.get(target);
    EXPECT_EQ(std::string(answer.body.begin(), answer.body.end()), target);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

TEST(HttpClient, NothingGetsIntoARequest) {
  FakeServer server([](const FakeRequest&) { return Reply{whole("200 OK", "", "")}; });
  HttpClient client(server.options());
  EXPECT_THROW(client.get("/a b"), Error);
  EXPECT_THROW(client.get("a"), Error);
  EXPECT_THROW(client.get("/", {{"x", "1\r\nY: 2"}}), Error);
  ClientOptions options = server.options();
  options.token = "a\nb";
  EXPECT_THROW(HttpClient{options}, Error);
  EXPECT_EQ(percent_encoded("a/b c,d%"), "a%2Fb%20c,d%25");
  EXPECT_EQ(server.requests, 0);
}

TEST(HttpClient, StopEndsWhatIsUnderWay) {
  FakeServer server([](const FakeRequest&) { return Reply{""}; });
  ClientOptions options = server.options();
  options.answer = std::chrono::minutes(1);
  HttpClient client(options);
  const auto began = std::chrono::steady_clock::now();
  std::thread other([&] {
    while (server.requests == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    client.stop();
  });
  try {
    client.get("/");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
  other.join();
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(20));
  EXPECT_THROW(client.get("/"), Error);
}

TEST(HttpClient, Streams) {
  FakeServer server([](const FakeRequest&) {
    return Reply{head("200 OK", "Content-Type: text/event-stream\r\nConnection: close\r\n") + "one two", true,
                 std::chrono::milliseconds(1), 3};
  });
  HttpClient client(server.options());
  std::string all;
  int calls = 0;
  client.stream("/", {}, "text/event-stream", [&](std::string_view piece) {
    ++calls;
    all += piece;
    return true;
  });
  EXPECT_EQ(all, "one two");
  EXPECT_GE(calls, 2);
  EXPECT_THROW(client.stream("/", {}, "text/plain", [](std::string_view) { return true; }), Error);
}

TEST(HttpClient, ASilentStreamEnds) {
  FakeServer server([](const FakeRequest&) { return Reply{head("200 OK", "Content-Type: text/event-stream\r\n")}; });
  ClientOptions options = server.options();
  options.silence = std::chrono::milliseconds(100);
  HttpClient client(options);
  EXPECT_THROW(client.stream("/", {}, "text/event-stream", [](std::string_view) { return true; }), Error);
}

TEST(ServerUrl, IsReadWhole) {
  const ServerUrl url = parse_server_url("http://maps.example:8080/a/b/");
  EXPECT_EQ(url.authority() + url.prefix, "maps.example:8080/a/b");
  EXPECT_EQ(parse_server_url("http://h").port, "80");
  EXPECT_EQ(parse_server_url("http://[::1]:9").host, "::1");
  EXPECT_EQ(parse_server_url("http://[::1]:9").authority(), "[::1]:9");
  for (const char* wrong :
       {"", "h", "https://h", "ftp://h", "http://", "http://h:", "http://h:0", "http://h:70000", "http://h:8x",
        "http://u@h", "http://h?x", "http://h/a?x", "http://h/ a", "http://[::1", "http://[::1]x", "http://h\r\n"})
    EXPECT_THROW(parse_server_url(wrong), Error) << wrong;
}

}  // namespace
}  // namespace btms::test
