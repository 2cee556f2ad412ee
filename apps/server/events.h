// What listeners of a map hear: a line a published revision, the last ones kept for those who come back.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace btms {

// One listener's queue, between the publisher and the connection that writes. Thread-safe.
class EventStream {
 public:
  using Area = std::optional<std::array<double, 4>>;  // min x, min y, max x, max y; nothing: everywhere
  explicit EventStream(Area area) : area_(area) {}
  const Area& area() const { return area_; }

  // A listener that doesn't keep up loses what waits and is told to start over.
  void push(std::string text);
  // What waits, one text; empty when nothing does.
  std::string take();
  // Called after push(); by any thread.
  void on_push(std::function<void()> wake);

 private:
  const Area area_;
  std::mutex mutex_;
  std::string waiting_;
  std::function<void()> wake_;
};

struct ChangedTile {
  std::string id, etag;
  std::array<double, 4> bounds_m{};
};
struct MapEvent {
  std::uint64_t revision = 0;
  std::string reason;  // "update", or "rebuild" when nothing is as it was
  std::vector<ChangedTile> tiles;
};
// {revision, reason, tiles} of the tiles in the area.
std::string event_json(const MapEvent& event, const EventStream::Area& area);

// Thread-safe.
class EventLog {
 public:
  void publish(MapEvent event);
  // Those after a revision, oldest first; nothing when they are not all kept any more.
  std::optional<std::vector<MapEvent>> since(std::uint64_t revision, std::uint64_t current) const;
  // Hears everything after `last`; a listener without one hears what comes.
  std::shared_ptr<EventStream> listen(EventStream::Area area, std::optional<std::uint64_t> last, std::uint64_t current);
  std::size_t listeners() const;

 private:
  static constexpr std::size_t kKept = 64;
  std::optional<std::vector<MapEvent>> kept_since(std::uint64_t revision, std::uint64_t current) const;
  mutable std::mutex mutex_;
  std::deque<MapEvent> kept_;
  mutable std::vector<std::weak_ptr<EventStream>> streams_;
};

}  // namespace btms
