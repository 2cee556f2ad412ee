#include "apps/server/events.h"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace btms {
namespace {

constexpr std::size_t kMostWaiting_bytes = std::size_t{4} << 20;

std::string event_text(const MapEvent& event, const EventStream::Area& area) {
  return "id: " + std::to_string(event.revision) + "\nevent: tiles\ndata: " + event_json(event, area) + "\n\n";
}
std::string reset_text(std::uint64_t revision) {
  const std::string r = std::to_string(revision);
  return "id: " + r + "\nevent: reset\ndata: {\"revision\":" + r + "}\n\n";
}

bool meet(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  return a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
}

}  // namespace

void EventStream::push(std::string text) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() + text.size() > kMostWaiting_bytes)
    waiting_ = "event: reset\ndata: {}\n\n";
  else
    waiting_ += text;
  if (wake_) wake_();
}

std::string EventStream::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(waiting_, {});
}

void EventStream::on_push(std::function<void()> wake) {
  const std::lock_guard lock(mutex_);
  wake_ = std::move(wake);
  if (wake_ && !waiting_.empty()) wake_();
}

std::string event_json(const MapEvent& event, const EventStream::Area& area) {
  nlohmann::json tiles = nlohmann::json::array();
  for (const ChangedTile& tile : event.tiles)
    if (!area || meet(*area, tile.bounds_m))
      tiles.push_back({{"id", tile.id}, {"etag", tile.etag}, {"bbox", tile.bounds_m}});
  return nlohmann::json{{"revision", event.revision}, {"reason", event.reason}, {"tiles", std::move(tiles)}}.dump();
}

void EventLog::publish(MapEvent event) {
  const std::lock_guard lock(mutex_);
  std::erase_if(streams_, [](const auto& stream) { return stream.expired(); });
  for (const auto& weak : streams_)
    if (const auto stream = weak.lock()) stream->push(event_text(event, stream->area()));
  kept_.push_back(std::move(event));
  if (kept_.size() > kKept) kept_.pop_front();
}

std::optional<std::vector<MapEvent>> EventLog::since(std::uint64_t revision, std::uint64_t current) const {
  const std::lock_guard lock(mutex_);
  return kept_since(revision, current);
}

std::optional<std::vector<MapEvent>> EventLog::kept_since(std::uint64_t revision, std::uint64_t current) const {
  if (revision > current) return {};
  std::vector<MapEvent> out;
  for (const MapEvent& event : kept_)
    if (event.revision > revision) out.push_back(event);
  // The first kept is the next after the revision, or there was none since.
  const bool whole = out.empty() ? revision == current : out.front().revision == revision + 1;
  if (!whole) return {};
  return out;
}

std::shared_ptr<EventStream> EventLog::listen(EventStream::Area area, std::optional<std::uint64_t> last,
                                              std::uint64_t current) {
  auto stream = std::make_shared<EventStream>(area);
  // One lock for both: an event between what was missed and the first that is pushed would be lost.
  const std::lock_guard lock(mutex_);
  const auto missed = last ? kept_since(*last, current) : std::vector<MapEvent>{};
  if (!missed) {
    stream->push(reset_text(current));
  } else {
    for (const MapEvent& event : *missed) stream->push(event_text(event, area));
  }
  streams_.push_back(stream);
  return stream;
}

std::size_t EventLog::listeners() const {
  const std::lock_guard lock(mutex_);
  std::erase_if(streams_, [](const auto& stream) { return stream.expired(); });
  return streams_.size();
}

}  // namespace btms
