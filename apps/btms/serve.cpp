// btms serve: maps over HTTP, for planners and browsers.
#include <spdlog/spdlog.h>

#include <filesystem>
#include <fstream>

#include "apps/btms/command.h"
#include "apps/btms/open_map.h"
#include "apps/btms/report.h"
#include "apps/server/http_server.h"
#include "engine/error.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

struct ServeCommand {
  CommonOptions common;
  std::vector<std::string> maps;
  HttpOptions http;
  std::string viewer, token_file;
  std::uint64_t cache_bytes = std::uint64_t{512} << 20;
  std::size_t max_connections = ServerLimits{}.connections;
  bool open_to_others = false;
};

// The viewer that was built with the program: ../share/btms/viewer.
fs::path built_viewer() {
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  const fs::path viewer = program.parent_path().parent_path() / "share/btms/viewer";
  return fs::is_regular_file(viewer / "index.html", ignored) ? viewer : fs::path();
}

std::string read_token(const std::string& path) {
  std::ifstream file(path);
  std::string token;
  std::getline(file, token);
  if (!file && token.empty()) throw Error(ErrorCode::kUsage, "no token in the first line of the file", path);
  return token;
}

bool is_loopback(const std::string& address) { return address.starts_with("127.") || address == "::1"; }

int run_serve(const ServeCommand& command) {
  ServiceOptions options;
  for (const std::string& map : command.maps) {
    check_is_map(map);
    options.maps.emplace_back(fs::absolute(map));
  }
  options.viewer = command.viewer.empty() ? built_viewer() : fs::path(command.viewer);
  if (!command.token_file.empty()) options.token = read_token(command.token_file);
  options.cache_bytes = command.cache_bytes;
  options.limits.connections = command.max_connections;
  if (!is_loopback(command.http.address)) {
    if (!command.open_to_others)
      throw Error(ErrorCode::kUsage, "other machines could reach " + command.http.address + ": say --public, too");
    if (options.token.empty())
      spdlog::warn("everybody who can reach this machine can read the maps: --token-file asks them for a token");
  }
  Service service(std::move(options));
  HttpServer server(service, command.http);
  const std::string host =
      command.http.address.find(':') == std::string::npos ? command.http.address : "[" + command.http.address + "]";
  const std::string url = fmt::format("http://{}:{}/", host, server.port());
  if (command.common.json)
    print_json(Json{{"url", url}});
  else
    print_line(url);
  std::fflush(stdout);
  server.run([](const std::string& wrong) { spdlog::warn("{}", wrong); });
  return 0;
}

constexpr const char* kServeFooter =
    "Examples:\n"
    "  btms serve city.btms                        # http://127.0.0.1:8080/ : a viewer, and the API below /v1\n"
    "  curl 'http://127.0.0.1:8080/v1/maps/city/height?x=200&y=150'\n"
    "  btms serve maps/*.btms --port 9000 --cache 2G\n"
    "\n"
    "Prints its URL when it is ready, and serves until Ctrl-C. A map's name is its folder's without .btms. When a "
    "build\n"
    "publishes a new revision, requests get it from then on, and listeners of its events are told what has changed.\n"
    "Nothing a client sends changes a file. docs/http_api.md has every request.";

}  // namespace

Command add_serve(CLI::App& btms) {
  auto command = std::make_shared<ServeCommand>();
  CLI::App* app = btms.add_subcommand("serve", "Serve maps over HTTP: tiles, heights, checks, a viewer");
  app->footer(kServeFooter);
  app->add_option("MAP", command->maps, "Maps made by `btms build`")->required()->type_name("");
  app->add_option("--port", command->http.port, "Port; 0 takes any that is free")->capture_default_str();
  app->add_option("--address", command->http.address, "Address to listen at")->capture_default_str();
  app->add_flag("--public", command->open_to_others, "Other machines may connect: for an --address of theirs");
  app->add_option("--token-file", command->token_file, "Ask for the token in the first line of FILE")
      ->type_name("FILE");
  app->add_option("--viewer", command->viewer, "Folder of the built viewer (default: the one built with the program)")
      ->type_name("FOLDER");
  app->add_option("--cache", command->cache_bytes, "Memory for tiles and answers")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(std::uint64_t{16} << 20, std::uint64_t{1} << 50))
      ->default_str("512M")
      ->type_name("SIZE");
  app->add_option("--max-connections", command->max_connections, "Connections at a time")->capture_default_str();
  app->add_option("--io-threads", command->http.threads, "Threads that read and write; as many work")
      ->capture_default_str()
      ->check(CLI::Range(1, 64));
  add_output_options(*app, command->common);
  return {app, {command, &command->common}, [command] { return run_serve(*command); }};
}

}  // namespace btms
