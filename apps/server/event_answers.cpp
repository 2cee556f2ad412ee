// Events of a map: a stream, or what has happened since a revision.
#include <charconv>
#include <cmath>

#include "apps/server/handlers.h"

namespace btms {
namespace {

std::optional<std::uint64_t> revision_of(const std::string& text, const char* field) {
  if (text.empty()) return {};
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw Problem("bad_parameter", "expected a revision", field);
  return value;
}

EventStream::Area area_of(const std::string& text) {
  if (text.empty()) return {};
  std::array<double, 4> box{};
  const char *at = text.data(), *end = text.data() + text.size();
  for (std::size_t i = 0; i < box.size(); ++i) {
    if (i > 0 && (at == end || *at++ != ',')) throw Problem("bad_parameter", "expected four numbers", "bbox");
    const auto [next, error] = std::from_chars(at, end, box[i]);
    if (error != std::errc() || !std::isfinite(box[i])) throw Problem("bad_parameter", "expected four numbers", "bbox");
    at = next;
  }
  if (at != end) throw Problem("bad_parameter", "expected four numbers", "bbox");
  return box;
}

}  // namespace

Response get_events(const Call& call) {
  EventLog& log = call.map->events();
  const std::uint64_t current = call.revision->number();
  const EventStream::Area area = area_of(parameter(call, "bbox", ""));
  Response response;
  response.set("Cache-Control", "no-store");
  if (const auto since = revision_of(parameter(call, "since", ""), "since")) {
    const auto events = log.since(*since, current);
    if (events && events->empty()) {
      response.status = 204;
      return response;
    }
    Json list = Json::array();
    for (const MapEvent& event : events.value_or(std::vector<MapEvent>{}))
      list.push_back(Json::parse(event_json(event, area)));
    Response json = json_response({{"revision", current}, {"reset", !events}, {"events", std::move(list)}});
    json.headers = response.headers;
    return json;
  }
  response.content_type = "text/event-stream";
  response.events = log.listen(area, revision_of(call.request.header("last-event-id"), "Last-Event-ID"), current);
  return response;
}

}  // namespace btms
