// Whole requests to the tile service, as text: METHOD TARGET, lines of headers, an empty line, the body.
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/server/events.h"
#include "apps/server/problem.h"
#include "apps/server/service.h"
#include "tests/fuzz/fuzz.h"
#include "tests/io/store/made_map.h"

namespace btms::fuzz {
namespace {

// Hills of two tiles; small limits, so that an input is done in milliseconds.
const Service& service() {
  static const Service only = [] {
    const std::filesystem::path map = folder() / "hills.btms";
    const MapLayout layout = layout_of(1000, 64);
    Tiles tiles;
    for (const TileId id : {TileId{0, 0}, TileId{1, 0}}) tiles.emplace(id, hilly_tile(layout, layout.grid.box_of(id)));
    write_map(map, layout, tiles, "EPSG:25832");
    ServiceOptions options;
    options.maps = {map};
    options.cache_bytes = 16 << 20;
    options.limits.points = 1000;
    options.limits.window_values = 1 << 16;
    options.limits.ids = 100;
    options.limits.bundle = 8;
    options.limits.route_nodes = 10'000;
    return Service(std::move(options));
  }();
  return only;
}

// Nothing when the target can't be parsed.
std::optional<Request> request_of(std::string_view text) {
  const auto line = [&] {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view front = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    return front;
  };
  Request request;
  const std::string_view first = line();
  const std::size_t space = std::min(first.find(' '), first.size());
  request.method = first.substr(0, space);
  try {
    parse_target(first.substr(std::min(space + 1, first.size())), request);
  } catch (const Problem& problem) {
    require(problem.status() == 400, "a target that can't be parsed is a 400");
    return {};
  }
  for (std::string_view header = line(); !header.empty(); header = line()) {
    const std::size_t colon = std::min(header.find(':'), header.size());
    request.headers[std::string(header.substr(0, colon))] = header.substr(std::min(colon + 1, header.size()));
  }
  request.body = text;
  return request;
}

void check(const Request& request, const Response& answer) {
  require(answer.status >= 200 && answer.status < 504, "a status that means something");
  require(answer.status != 500, "no request makes the service fail");
  const bool bodiless = answer.status == 204 || answer.status == 304;
  require(!bodiless || !answer.body || answer.body->empty(), "204 and 304 have no body");
  require(bodiless || answer.body || answer.events, "every other answer has one");
  if (answer.status >= 400) {
    const auto json = nlohmann::json::parse(*answer.body, nullptr, false);
    require(json.is_object() && json.value("status", 0) == answer.status, "problems are JSON that names the status");
  }
  for (const auto& [name, value] : answer.headers)
    require((name + value).find_first_of("\r\n") == std::string::npos, "headers are one line each");
  require(answer.status != 206 || request.headers.contains("range"), "parts only for those who ask");
}

}  // namespace

void requests(Bytes bytes) {
  const auto request = request_of({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (!request) return;
  check(*request, service().answer(*request));
  if (const auto at_once = service().answer_at_once(*request)) check(*request, *at_once);
}

}  // namespace btms::fuzz
