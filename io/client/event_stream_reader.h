// Server-sent events from the bytes of a stream, in whatever pieces they come.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace btms {

struct ServerSentEvent {
  std::string id, name, data;
};

class EventStreamReader {
 public:
  explicit EventStreamReader(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  // Throws Error(kBadInput) when an event is longer than the most.
  void feed(std::string_view piece);
  // The next whole event, if there is one.
  std::optional<ServerSentEvent> next();

 private:
  const std::size_t most_bytes_;
  std::string waiting_;
  ServerSentEvent event_;
};

}  // namespace btms
