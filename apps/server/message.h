// A request and its answer, without sockets.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace btms {

struct Request {
  std::string method = "GET";
  std::vector<std::string> path;               // decoded segments
  std::map<std::string, std::string> query;    // decoded
  std::map<std::string, std::string> headers;  // names in lower case
  std::string body;

  std::string header(const std::string& name) const {
    const auto it = headers.find(name);
    return it == headers.end() ? std::string() : it->second;
  }
};

// Parses a target into path and query. Throws Problem("bad_target").
void parse_target(std::string_view target, Request& request);

using Body = std::shared_ptr<const std::vector<std::uint8_t>>;
Body body_of(std::string_view text);

class EventStream;

struct Response {
  int status = 200;
  std::string content_type;
  std::vector<std::pair<std::string, std::string>> headers;
  Body body;
  std::shared_ptr<EventStream> events;  // instead of a body: goes on until either side ends it

  void set(std::string name, std::string value) { headers.emplace_back(std::move(name), std::move(value)); }
};

}  // namespace btms
