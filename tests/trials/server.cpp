// Trial: the tile server under load and abuse, on loopback.
//
// Starts `btms serve` on a map, then measures how soon it is ready, what /healthz takes while clients send half of
// their requests and nothing more, what becomes of a header without an end, the memory of an idle connection, what a
// diff takes, and how long after an update its event arrives. Throughput is wrk's: tests/load.sh.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <thread>
#include <vector>

#include "tests/cli/program.h"
#include "tests/support/socket_client.h"

namespace btms::test {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

double ms_since(Clock::time_point began) {
  return std::chrono::duration<double, std::milli>(Clock::now() - began).count();
}
double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

void demand(bool holds, const std::string& what) {
  if (holds) return;
  std::fprintf(stderr, "trial_server: %s\n", what.c_str());
  std::exit(1);
}

// A server and what it said.
class Served {
 public:
  explicit Served(const std::string& map)
      : began_(Clock::now()),
        process_({"serve", map, "--port", "0", "--max-connections", "8192"}, {}, folder_ / "said") {
    std::string said;
    while (said.find('\n') == std::string::npos) {
      demand(!process_.has_ended(), "the server ended: " + process_.err_so_far());
      std::this_thread::sleep_for(1ms);
      said = read_text(folder_ / "said");
    }
    port_ = static_cast<std::uint16_t>(std::stoi(said.substr(said.rfind(':') + 1)));
    demand(one("GET /readyz HTTP/1.1\r\nConnection: close\r\n\r\n").starts_with("HTTP/1.1 200"), "it is not ready");
    ready_ms_ = ms_since(began_);
  }
  std::uint16_t port() const { return port_; }
  double ready_ms() const { return ready_ms_; }
  std::string one(const std::string& request) const {
    SocketClient client(port_);
    client.send(request);
    return client.read_until("\1 never", 20s);
  }
  // What its metrics say is counted from outside: resident bytes.
  std::uint64_t resident_bytes() {
    std::istringstream status(read_text("/proc/" + std::to_string(process_.pid()) + "/status"));
    for (std::string line; std::getline(status, line);)
      if (line.starts_with("VmRSS:")) return std::stoull(line.substr(6)) * 1024;
    return 0;
  }
  int end() {
    process_.send(SIGTERM);
    return process_.wait().status;
  }

 private:
  TempFolder folder_;
  Clock::time_point began_;
  Running process_;
  std::uint16_t port_ = 0;
  double ready_ms_ = 0;
};

const std::string kHealth = "GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n";

double slowest_health_ms(const Served& server, int asked) {
  SocketClient client(server.port());
  double slowest = 0;
  for (int i = 0; i < asked; ++i) {
    const auto began = Clock::now();
    client.forget();
    client.send(kHealth);
    demand(client.read_until("\"ok\"}", 5s).starts_with("HTTP/1.1 200"), "/healthz was not answered");
    slowest = std::max(slowest, ms_since(began));
    std::this_thread::sleep_for(2ms);
  }
  return slowest;
}

std::vector<std::unique_ptr<SocketClient>> halves(const Served& server, int count) {
  std::vector<std::unique_ptr<SocketClient>> clients;
  for (int i = 0; i < count; ++i) {
    clients.push_back(std::make_unique<SocketClient>(server.port()));
    clients.back()->send(i % 2 ? "GET /v1/maps HT"
                               : "POST /v1/maps/city/diff HTTP/1.1\r\nHost: x\r\nContent-Length: 900\r\n\r\n{");
  }
  return clients;
}

// Bytes of a header that were taken before the server had enough.
std::uint64_t endless_header(const Served& server, std::uint64_t most) {
  SocketClient client(server.port());
  std::string piece = "GET / HTTP/1.1\r\nLong: ";
  std::uint64_t sent = 0;
  while (sent < most && client.send(piece)) {
    sent += piece.size();
    piece.assign(1 << 20, 'a');
  }
  return sent;
}

double diff_ms(const Served& server, const std::string& id, int asked) {
  const std::string body = R"({"area": {"center": [200, 150], "radius": 300}})";
  const std::string request = "POST /v1/maps/" + id +
                              "/diff HTTP/1.1\r\nHost: x\r\nContent-Length: " + std::to_string(body.size()) +
                              "\r\n\r\n" + body;
  SocketClient client(server.port());
  std::vector<double> took;
  for (int i = 0; i < asked; ++i) {
    const auto began = Clock::now();
    client.forget();
    client.send(request);
    demand(client.read_until("\"revision\":1}", 5s).starts_with("HTTP/1.1 200"), "a diff was not answered");
    took.push_back(ms_since(began));
  }
  return median(took);
}

double event_ms(const Served& server, const std::string& map, const std::string& id, const TempFolder& folder) {
  SocketClient listener(server.port());
  listener.send("GET /v1/maps/" + id + "/events HTTP/1.1\r\nHost: x\r\n\r\n");
  listener.read_until(": events");
  run_json({"synth", "--points", "20000", "--seed", "9", "-o", folder / "more"});
  std::thread update([&] { run_json({"build", folder / "more", "-o", map, "--update"}); });
  // The manifest's new time is when it was published.
  const auto manifest = fs::path(map) / "manifest.json";
  const auto before = fs::last_write_time(manifest);
  while (fs::last_write_time(manifest) == before) std::this_thread::sleep_for(1ms);
  const auto published = Clock::now();
  listener.read_until("event: tiles", 20s);
  const double ms = ms_since(published);
  update.join();
  return ms;
}

int run_trial(int points, double density, int slow, int idle, std::uint64_t header_bytes) {
  const TempFolder folder;
  const std::string map = folder / "city.btms", many = folder / "many.btms";
  run_json({"synth", "--points", "300000", "-o", folder / "truth"});
  run_json({"build", folder / "truth", "-o", map, "--updatable"});
  run_json({"synth", "--points", std::to_string(points), "--density", std::to_string(density), "-o", folder / "wide"});
  const auto built = run_json({"build", folder / "wide", "-o", many, "--tile-cells", "1"});

  double ready_ms = 0, diff = 0;
  {
    Served server(many);
    ready_ms = server.ready_ms();
    diff = diff_ms(server, "many", 200);
    demand(server.end() == 0, "the server did not end well");
  }
  Served server(map);
  // Connections that have been answered and stay.
  const std::uint64_t before = server.resident_bytes();
  std::vector<std::unique_ptr<SocketClient>> idlers;
  for (int i = 0; i < idle; ++i) {
    idlers.push_back(std::make_unique<SocketClient>(server.port()));
    idlers.back()->send(kHealth);
    idlers.back()->read_until("\"ok\"}");
  }
  const double connection_KiB =
      (static_cast<double>(server.resident_bytes()) - static_cast<double>(before)) / 1024 / idle;
  idlers.clear();
  const double quiet_ms = slowest_health_ms(server, 200);
  double slow_ms = 0;
  {
    const auto clients = halves(server, slow);
    slow_ms = slowest_health_ms(server, 200);
  }
  const std::uint64_t before_header = server.resident_bytes(), taken = endless_header(server, header_bytes);
  demand(taken < header_bytes, "a header of " + std::to_string(header_bytes) + " bytes was read");
  const std::uint64_t grown = server.resident_bytes() - std::min(before_header, server.resident_bytes());

  const double event = event_ms(server, map, "city", folder);
  demand(server.end() == 0, "the server did not end well");

  std::printf("ready with %d tiles: %.0f ms\n", built["tiles"].get<int>(), ready_ms);
  std::printf("diff of 300 m among them: %.2f ms\n", diff);
  std::printf("/healthz: %.1f ms at the slowest, %.1f ms beside %d half requests\n", quiet_ms, slow_ms, slow);
  std::printf("endless header: refused after %.1f MB, memory grown by %.1f MB\n", static_cast<double>(taken) / 1e6,
              static_cast<double>(grown) / 1e6);
  std::printf("an idle connection: %.1f KiB\n", connection_KiB);
  std::printf("event after publishing: %.0f ms\n", event);
  return 0;
}

}  // namespace
}  // namespace btms::test

int main(int argc, char** argv) {
  CLI::App app("The tile server under load and abuse; all figures at the end", "trial_server");
  int points = 11'000'000, slow = 500, idle = 1000, header_mb = 200;
  app.add_option("POINTS", points, "of the map of many tiles, one per square metre")->capture_default_str();
  app.add_option("SLOW", slow, "clients that send half a request")->capture_default_str();
  app.add_option("IDLE", idle, "connections that stay")->capture_default_str();
  app.add_option("HEADER", header_mb, "MB of a header")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  rlimit files{};
  getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  setrlimit(RLIMIT_NOFILE, &files);
  return btms::test::run_trial(points, 1, slow, idle, static_cast<std::uint64_t>(header_mb) << 20);
}
