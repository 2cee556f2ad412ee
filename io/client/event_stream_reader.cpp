#include "io/client/event_stream_reader.h"

#include <algorithm>
#include <utility>

#include "engine/error.h"

namespace btms {

void EventStreamReader::feed(std::string_view piece) {
  if (waiting_.size() + event_.data.size() + piece.size() > most_bytes_)
    throw Error(ErrorCode::kBadInput, "an event of the server is too long");
  waiting_ += piece;
}

std::optional<ServerSentEvent> EventStreamReader::next() {
  std::size_t begin = 0;
  std::optional<ServerSentEvent> out;
  for (std::size_t end; !out && (end = waiting_.find('\n', begin)) != waiting_.npos; begin = end + 1) {
    std::string_view line = std::string_view(waiting_).substr(begin, end - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty()) {
      if (!event_.name.empty() || !event_.data.empty()) out = std::exchange(event_, {});
      event_ = {};
      continue;
    }
    if (line.front() == ':') continue;
    const std::size_t colon = std::min(line.find(':'), line.size());
    const std::string_view name = line.substr(0, colon);
    std::string_view value = line.substr(std::min(colon + 1, line.size()));
    if (value.starts_with(' ')) value.remove_prefix(1);
    if (name == "id") event_.id = value;
    if (name == "event") event_.name = value;
    if (name == "data") event_.data.append(event_.data.empty() ? "" : "\n").append(value);
  }
  waiting_.erase(0, begin);
  return out;
}

}  // namespace btms
