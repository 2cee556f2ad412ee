// The server at a real socket: what well-behaved and ill-behaved clients get.
#include <thread>

#include "apps/server/http_server.h"
#include "tests/server/served_city.h"
#include "tests/support/socket_client.h"

namespace btms::test {
namespace {

using namespace std::chrono_literals;

class Sockets : public ServedCity {
 protected:
  void serve(ServerLimits limits = {}) {
    ServiceOptions options = ServedCity::options();
    options.limits = limits;
    service_ = std::make_unique<Service>(std::move(options));
    server_ = std::make_unique<HttpServer>(*service_, HttpOptions{"127.0.0.1", 0, 2});
    thread_ = std::thread([this] { server_->run([](const std::string&) {}); });
  }
  void TearDown() override {
    if (server_) server_->stop();
    if (thread_.joinable()) thread_.join();
  }
  std::uint16_t port() const { return server_->port(); }
  Service& service() { return *service_; }
  std::string one(const std::string& request) {
    SocketClient client(port());
    client.send(request);
    return client.rest();
  }

  std::unique_ptr<Service> service_;
  std::unique_ptr<HttpServer> server_;
  std::thread thread_;
};

const std::string kHealth = "GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n";

TEST_F(Sockets, AnswersOneRequestAfterAnother) {
  serve();
  SocketClient client(port());
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(client.send(kHealth));
    EXPECT_TRUE(client.read_until("\"ok\"}").starts_with("HTTP/1.1 200 OK\r\n"));
    client.forget();
  }
  // Several in one piece, and one in many.
  client.send(kHealth + kHealth + "GET /readyz HTTP/1.1\r\nHost: x\r\n\r\n");
  const std::string all = client.read_until("\"ready\"}");
  EXPECT_EQ(all.find("200 OK"), 9u);
  EXPECT_NE(all.find("\"status\":\"ready\""), std::string::npos);
  client.forget();
  for (const char c : kHealth) client.send({c});
  EXPECT_TRUE(client.read_until("\"ok\"}").starts_with("HTTP/1.1 200 OK"));
  EXPECT_FALSE(client.closed());
}

TEST_F(Sockets, HeadAndCloseAndOldProtocols) {
  serve();
  const std::string head = one("HEAD /v1/maps HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  EXPECT_NE(head.find("Content-Length: "), std::string::npos);
  EXPECT_TRUE(head.ends_with("\r\n\r\n")) << head;
  EXPECT_TRUE(one("GET /healthz HTTP/1.0\r\n\r\n").starts_with("HTTP/1.1 200"));
}

TEST_F(Sockets, RefusesWhatIsMalformed) {
  ServerLimits limits;
  limits.header = limits.idle = 500ms;
  serve(limits);
  for (const std::string request :
       {"nonsense\r\n\r\n", "GET /healthz\r\n\r\n", "GET /healthz HTTP/9.9\r\n\r\n", "GET  HTTP/1.1\r\n\r\n",
        "GET /%zz HTTP/1.1\r\nHost: x\r\n\r\n", "\r\n\r\n\r\n\r\nx\r\n\r\n", "GET /healthz HTTP/1.1\r\nA b: c\r\n\r\n",
        "POST /v1/maps/city/diff HTTP/1.1\r\nHost: x\r\nContent-Length: -1\r\n\r\n",
        "POST /v1/maps/city/diff HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\nab",
        "POST /v1/maps/city/diff HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n"}) {
    const std::string answer = one(request);
    EXPECT_TRUE(answer.empty() || answer.starts_with("HTTP/1.1 400") || answer.starts_with("HTTP/1.1 408"))
        << request << answer;
  }
  EXPECT_TRUE(one(std::string(64, '\0') + "\r\n\r\n").find("200 OK") == std::string::npos);
  EXPECT_TRUE(one("GET /healthz HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n").starts_with("HTTP/1.1 200"));
}

TEST_F(Sockets, BoundsWhatItReads) {
  serve();
  EXPECT_TRUE(one("GET /" + std::string(3000, 'a') + " HTTP/1.1\r\nHost: x\r\n\r\n").starts_with("HTTP/1.1 414"));
  EXPECT_TRUE(one("GET /" + std::string(30'000, 'a') + " HTTP/1.1\r\nHost: x\r\n\r\n").starts_with("HTTP/1.1 414"));
  EXPECT_TRUE(
      one("GET / HTTP/1.1\r\nHost: x\r\nLong: " + std::string(30'000, 'a') + "\r\n\r\n").starts_with("HTTP/1.1 431"));
  EXPECT_TRUE(one("POST /v1/maps/city/diff HTTP/1.1\r\nHost: x\r\nContent-Length: 99999999\r\n\r\n{")
                  .starts_with("HTTP/1.1 413"));
  // A header without an end: the connection ends long before it would.
  SocketClient endless(port());
  std::string piece = "GET / HTTP/1.1\r\nLong: ";
  std::size_t sent = 0;
  while (sent < (std::size_t{64} << 20) && endless.send(piece)) {
    sent += piece.size();
    piece.assign(1 << 16, 'a');
  }
  EXPECT_LT(sent, std::size_t{64} << 20);
  // Chunks that add up to more than a body may have.
  SocketClient chunks(port());
  chunks.send("POST /v1/maps/city/diff HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n");
  const std::string chunk = "100000\r\n" + std::string(0x100000, '1') + "\r\n";
  for (int i = 0; i < 10; ++i)
    if (!chunks.send(chunk)) break;
  EXPECT_TRUE(chunks.rest().starts_with("HTTP/1.1 413"));
}

TEST_F(Sockets, SlowClientsAreLetGoAndHoldUpNobody) {
  ServerLimits limits;
  limits.header = 700ms;
  limits.body = 700ms;
  limits.idle = 700ms;
  serve(limits);
  std::vector<std::unique_ptr<SocketClient>> slow;
  for (int i = 0; i < 200; ++i) {
    slow.push_back(std::make_unique<SocketClient>(port()));
    slow.back()->send(i % 2 ? "GET /healthz HT"
                            : "POST /v1/maps/city/diff HTTP/1.1\r\nHost: x\r\nContent-Length: 50\r\n\r\n{");
  }
  EXPECT_TRUE(one("GET /healthz HTTP/1.1\r\nConnection: close\r\n\r\n").starts_with("HTTP/1.1 200"));
  for (auto& client : slow) EXPECT_TRUE(client->rest().starts_with("HTTP/1.1 408"));
  SocketClient silent(port());
  EXPECT_EQ(silent.rest(), "");
  EXPECT_TRUE(silent.closed());
}

TEST_F(Sockets, CountsItsConnections) {
  ServerLimits limits;
  limits.connections = 3;
  serve(limits);
  std::vector<std::unique_ptr<SocketClient>> held;
  for (int i = 0; i < 3; ++i) {
    held.push_back(std::make_unique<SocketClient>(port()));
    held.back()->send(kHealth);
    EXPECT_TRUE(held.back()->read_until("\"ok\"}").starts_with("HTTP/1.1 200"));
  }
  SocketClient one_more(port());
  EXPECT_TRUE(one_more.rest().starts_with("HTTP/1.1 503"));
  held.pop_back();
  std::string answer;
  for (int i = 0; i < 200 && !answer.starts_with("HTTP/1.1 200"); ++i) {
    std::this_thread::sleep_for(10ms);
    answer = one("GET /healthz HTTP/1.1\r\nConnection: close\r\n\r\n");
  }
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 200"));
}

TEST_F(Sockets, TellsListenersOfANewRevision) {
  serve();
  SocketClient listener(port());
  listener.send("GET /v1/maps/city/events HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_NE(listener.read_until(": events").find("text/event-stream"), std::string::npos);
  const std::uint64_t before = service().maps()[0]->current()->number();
  run_json({"synth", "--points", "20000", "--seed", std::to_string(before + 20), "-o",
            folder() / "more" + std::to_string(before)});
  run_json({"build", folder() / "more" + std::to_string(before), "-o", map_path(), "--update"});
  const std::string said = listener.read_until("\n\n", 5000ms);
  EXPECT_NE(listener.read_until("event: tiles").find("id: " + std::to_string(before + 1)), std::string::npos) << said;
}

TEST_F(Sockets, StopsGracefully) {
  serve();
  SocketClient idle(port()), listener(port());
  idle.send(kHealth);
  idle.read_until("\"ok\"}");
  listener.send("GET /v1/maps/city/events HTTP/1.1\r\nHost: x\r\n\r\n");
  listener.read_until(": events");
  server_->stop();
  thread_.join();
  idle.rest();
  listener.rest();
  EXPECT_TRUE(idle.closed());
  EXPECT_TRUE(listener.closed());
}

}  // namespace
}  // namespace btms::test
